"""``python -m calibench``: the program itself."""

import os
import sys

from calibench._program import program

if __name__ == "__main__":
    path = str(program())
    if os.name == "posix":
        os.execv(path, [path, *sys.argv[1:]])
    else:
        import subprocess

        sys.exit(subprocess.run([path, *sys.argv[1:]], check=False).returncode)
