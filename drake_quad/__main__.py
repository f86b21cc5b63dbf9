"""`python -m drake_quad` is `drake-quad`."""

from drake_quad.cli.main import main

if __name__ == "__main__":
    main()
