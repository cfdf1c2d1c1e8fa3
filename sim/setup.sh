#!/usr/bin/env bash
# Makes a Python environment, once: sim/setup.sh [REQUIREMENTS]. What REQUIREMENTS pins, or else sim/mujoco/requirements.txt (the feature `mujoco`), in
# $CALIBENCH_VENV, or else .venv.
# Exit codes: 0 it is ready, 1 it failed, 3 it cannot be had here (no fit Python, no network). Standard error says why, in one line.
set -euo pipefail
exec </dev/null

root="$(cd "$(dirname "${BASH_SOURCE[0]}")/.." && pwd -P)"
requirements="$(realpath "${1:-$root/sim/mujoco/requirements.txt}")"
venv="${CALIBENCH_VENV:-$root/.venv}"
[[ "$venv" == /* ]] || venv="$PWD/$venv"
# Empty while the environment is being made; filled last. Where it is, the environment is ours to clear.
stamp="$venv/calibench-stamp"

failed() {
    echo "$1" >&2
    exit "${2:-1}"
}

# What the stamp of a whole environment says: its Python, and the requirements. Every file of every package must have its recorded size.
state() {
    "$venv/bin/python" -I - "$requirements" 2>/dev/null <<'PYTHON'
import csv, hashlib, os, re, sys, sysconfig

site = sysconfig.get_path("purelib")
text = open(sys.argv[1], "rb").read()
wanted = set(re.findall(r"^([a-z0-9-]+)==", text.decode(), re.MULTILINE))
for folder in os.listdir(site):
    if folder.endswith(".dist-info"):
        wanted.discard(re.sub(r"[-_.]+", "-", folder.split("-")[0]).lower())
        for path, _, size in csv.reader(open(os.path.join(site, folder, "RECORD"), newline="")):
            # A wheel that brings a compiled file by mistake, as numpy 1.26.4 does, lists the size that it had before pip compiled it again.
            if size and not path.endswith(".pyc") and os.path.getsize(os.path.join(site, path)) != int(size):
                sys.exit(1)
if wanted:
    sys.exit(1)
print(hashlib.sha256(text).hexdigest(), sys.version.split()[0], sys.base_prefix)
PYTHON
}

ready() {
    [[ -s "$stamp" ]] && [[ "$(state)" == "$(<"$stamp")" ]]
}

# Sets `python` to the first in PATH that can make the environment and can be embedded in a program.
find_python() {
    local unfit reason=""
    while IFS= read -r python; do
        unfit="$("$python" -I - 2>/dev/null <<'PYTHON'
import os, sys, sysconfig

# The versions for which the pinned packages are published.
if not (3, 11) <= sys.version_info[:2] <= (3, 14):
    print("is Python %d.%d, and 3.11 to 3.14 is needed" % sys.version_info[:2])
    sys.exit()
library = os.path.join(sysconfig.get_config_var("LIBDIR") or "", sysconfig.get_config_var("LDLIBRARY") or "")
if not sysconfig.get_config_var("Py_ENABLE_SHARED") or not os.path.isfile(library):
    print("cannot be embedded, it has no shared library (Debian, Ubuntu: apt install python3-dev)")
    sys.exit()
try:
    import ensurepip, venv
except ImportError:
    print("cannot make environments (Debian, Ubuntu: apt install python3-venv)")
PYTHON
)" || continue
        [[ -n "$unfit" ]] || return 0
        reason="${reason:-$python $unfit}"
    done < <(type -ap python3 python3.14 python3.13 python3.12 python3.11)
    failed "${reason:-there is no Python; 3.11 to 3.14 is needed (Debian, Ubuntu: apt install python3-dev python3-venv)}" 3
}

if ready; then
    exit 0
fi
find_python
mkdir -p "$(dirname "$venv")"
# One set-up at a time: whoever waited finds the work done. The lock goes with the last process that holds the file open.
exec 9>"$venv.lock"
"$python" -c 'import fcntl; fcntl.flock(9, fcntl.LOCK_EX)'
if ready; then
    exit 0
fi
if [[ ! -e "$stamp" && -n "$(ls -A "$venv" 2>/dev/null)" ]]; then
    failed "$venv is there and was not made by sim/setup.sh: move it away, or name another place by CALIBENCH_VENV"
fi
echo "sim/setup.sh: making $venv with $("$python" --version): $(grep -v '^#' "${requirements%.txt}.in" | head -n 1) and what it needs"
mkdir -p "$venv"
: >"$stamp"
find "$venv/" -mindepth 1 -maxdepth 1 ! -name "$(basename "$stamp")" -exec rm -rf {} +
log="$venv/pip.log"
"$python" -m venv "$venv" >"$log" 2>&1 || failed "$python -m venv $venv failed: $(tail -n 3 "$log")"
if ! "$venv/bin/python" -m pip install --quiet --disable-pip-version-check --retries 2 \
    --require-hashes --only-binary :all: --requirement "$requirements" >>"$log" 2>&1; then
    if grep -q "connection broken" "$log"; then
        failed "the package index cannot be reached (no network?); see $log" 3
    elif grep -q "No matching distribution found" "$log"; then
        failed "$(grep -m 1 "No matching distribution found" "$log") on this machine; see $log" 3
    fi
    failed "pip failed: $(grep -m 1 ERROR "$log" || tail -n 1 "$log"); see $log"
fi
made="$(state)" || failed "$venv is not whole after its making; see $log"
echo "$made" >"$stamp"
