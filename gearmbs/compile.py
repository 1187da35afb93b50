"""Compile all kernels ahead: ``python -m gearmbs.compile``; see `gearmbs.kernels.ahead`."""

from gearmbs.kernels.ahead import main

if __name__ == "__main__":
    main()
