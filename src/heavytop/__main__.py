"""``python -m heavytop``: the same as the command ``heavytop``."""

from heavytop.cli import main

if __name__ == "__main__":
    main()
