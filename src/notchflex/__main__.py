"""`python -m notchflex` is the command `notchflex`."""

from notchflex.cli import main

if __name__ == "__main__":
    main()
