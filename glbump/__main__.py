"""`python -m glbump` is the command `glbump`."""

from glbump.cli import main

if __name__ == "__main__":
    main()
