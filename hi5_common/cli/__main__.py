"""`python -m hi5_common.cli` is `hi5`."""

from hi5_common.cli.app import main

if __name__ == "__main__":
    main()
