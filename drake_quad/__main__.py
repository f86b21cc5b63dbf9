"""`python -m drake_quad` is `drake-quad`."""

from drake_quad.cli import main

if __name__ == "__main__":
    main()
