"""`python -m realizer` and the console script."""

from realizer.cli import main

if __name__ == "__main__":
    main()
