"""``python -m gearmbs``: the command line."""

from gearmbs.cli import app

if __name__ == "__main__":
    app(prog_name="gearmbs")
