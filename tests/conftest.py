"""What every test starts from."""

import os

for name in ("COLUMNS", "LINES"):  # readline, which pytest imports, sets them for all processes
    os.environ.pop(name, None)
    os.unsetenv(name)
