#!/usr/bin/env bash
# The opening view of a recording as a picture, without a screen: screenshot.sh RECORDING.rrd PICTURE.png
# Needs the viewer (sim/view/requirements.txt, in $CALIBENCH_VENV, .venv-view or .venv) and a software Vulkan
# (Debian, Ubuntu: apt install --no-install-recommends mesa-vulkan-drivers libvulkan1).
set -euo pipefail
exec </dev/null

if [[ $# -ne 2 ]]; then
    echo "usage: $0 RECORDING.rrd PICTURE.png" >&2
    exit 2
fi
root="$(cd "$(dirname "${BASH_SOURCE[0]}")/../.." && pwd -P)"
# Not the script of that name in bin: it starts the viewer as a child, which a signal would leave behind.
for venv in ${CALIBENCH_VENV:+"$CALIBENCH_VENV"} "$root/.venv-view" "$root/.venv"; do
    viewer="$(find "$venv"/lib/python3*/site-packages/rerun_sdk/rerun_cli -name rerun 2>/dev/null | head -n 1)" || true
    [[ -z "$viewer" ]] || break
done
if [[ -z "$viewer" ]]; then
    echo "$0: there is no rerun; docs/replay.md says how to install it" >&2
    exit 3
fi

scratch="$(mktemp -d)"
trap 'rm -rf "$scratch"' EXIT
# No analytics, no settings of the user, and no messages over the picture.
export HOME="$scratch" XDG_CONFIG_HOME="$scratch" XDG_DATA_HOME="$scratch" XDG_RUNTIME_DIR="$scratch"
"$viewer" analytics disable >/dev/null 2>&1
RUST_LOG=error timeout 120 "$viewer" --headless --bind 127.0.0.1 --port auto \
    --window-size 1760x990 --screenshot-to "$scratch/twice.png" "$1" >"$scratch/log" 2>&1 || {
    tail -n 3 "$scratch/log" >&2
    exit 1
}
# The viewer draws two dots a point; on a page fewer are enough.
"$venv/bin/python" -I - "$scratch/twice.png" "$2" <<'PYTHON'
import sys
from PIL import Image

picture = Image.open(sys.argv[1]).convert("RGB")
picture = picture.resize((1600, 900), Image.Resampling.LANCZOS)
# A grey window has a few dozen colours, the story tens of thousands.
if len(picture.getcolors(1 << 24)) < 2000:
    sys.exit("the viewer has drawn nothing")
# 64 steps of each colour look the same and take a quarter less.
picture.point(lambda value: min(255, 4 * round(value / 4))).save(sys.argv[2], optimize=True)
PYTHON
