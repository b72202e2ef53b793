"""The entry point of `python -m realizer` and of the console script."""

from realizer.cli import main

if __name__ == "__main__":
    main()
