"""ADAMS decks in and out: .adm and .acf read and run, .res, .req and .msg written, mechanisms written as .adm."""

from gearmbs._lazy import late

__all__ = late(__name__)
