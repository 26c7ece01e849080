"""``python -m towtank`` is the command ``towtank``."""

from towtank.cli import main

if __name__ == "__main__":
    main()
