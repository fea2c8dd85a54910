#!/bin/sh
# Print the first of the given commands that is a Python >= 3.11 able to make a virtual
# environment; when there is none, say on stderr what is missing and how to get it.
newest="" unable=""
for python in "$@"; do
    # A command may exist and still not run (version managers leave such shims): so ask it.
    version=$("$python" -c 'import sys; print("%d.%d" % sys.version_info[:2])' 2>/dev/null) || continue
    if ! "$python" -c 'import sys; sys.exit(sys.version_info < (3, 11))' 2>/dev/null; then
        newest="${newest:+$newest, }$python is $version"
    elif ! "$python" -c 'import venv, ensurepip' 2>/dev/null; then
        unable="${unable:-$python}"
    else
        echo "$python"
        exit 0
    fi
done
if [ -n "$unable" ]; then
    echo "heavytop: $unable has no working venv module." >&2
    echo "  On Debian and Ubuntu: sudo apt install python3-venv (or $("$unable" -c 'import sys; print("python%d.%d" % sys.version_info[:2])')-venv)." >&2
else
    echo "heavytop: Python 3.11 or newer is missing (${newest:-none of: $* runs})." >&2
    echo "  Install it, or name it: make run PYTHON=/path/to/python3" >&2
fi
exit 1
