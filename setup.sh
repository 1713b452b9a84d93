#!/bin/sh
# Installs LIGGGHTS (apt, 420 MB on a bare Debian) and Python packages (.venv, 600 MB): what is missing.
# Says first what it will install and how large it is; a second call takes no time.
#   ./setup.sh                  for `make demo`
#   ./setup.sh test,lint        with these extras of pyproject.toml
#   ./setup.sh test,peers       for `make test-all`: YADE, Chromium (apt, 2.1 GB), libraries to judge by (.venv, 4 GB)
# PYTHON=/path/to/python3 chooses the Python that .venv is made with.
set -eu
cd "$(dirname "$0")"
extras=${1:-}
python=${PYTHON:-python3}

stop() {
    printf 'trackbed setup: %s\n' "$@" >&2
    exit 4
}

# --- system packages -----------------------------------------------------------------------
lacking=
command -v liggghts >/dev/null || lacking="$lacking liggghts"
command -v "$python" >/dev/null || lacking="$lacking python3 python3-venv"
if command -v "$python" >/dev/null; then
    "$python" -c 'import sys; sys.exit(sys.version_info < (3, 11))' || stop \
        "$("$python" --version) is too old: trackbed needs Python 3.11 or newer, as in Debian 12." \
        "Install one and run again with PYTHON=/path/to/python3.11."
    "$python" -c 'import ensurepip, venv' 2>/dev/null || lacking="$lacking python3-venv"
fi
case ",$extras," in *,peers,*)
    command -v chromium >/dev/null || lacking="$lacking chromium"
    command -v yade >/dev/null || lacking="$lacking yade"
    # what the Python wheels of gmsh and OVITO (Qt) are linked to
    for library in libGLU.so.1:libglu1-mesa libXcursor.so.1:libxcursor1 libXft.so.2:libxft2 \
        libXinerama.so.1:libxinerama1 libOpenGL.so.0:libopengl0 libEGL.so.1:libegl1 \
        libxkbcommon.so.0:libxkbcommon0 libdbus-1.so.3:libdbus-1-3; do
        /sbin/ldconfig -p | grep -q "${library%%:*}" || lacking="$lacking ${library##*:}"
    done
    ;;
esac

if [ -n "$lacking" ]; then
    command -v apt-get >/dev/null || stop "missing here:$lacking (Debian's names)." \
        "There is no apt-get on this system: install them by its own means and run again."
    as_root=
    if [ "$(id -u)" -ne 0 ]; then
        command -v sudo >/dev/null || stop "missing here:$lacking; installing them needs root." \
            "Ask for 'apt-get install$lacking' to be run as root, then run this again."
        as_root=sudo
        [ -t 0 ] || as_root="sudo -n" # nobody is there to type a password
    fi
    echo "trackbed setup: installing with ${as_root:+$as_root }apt-get:$lacking" \
        "(of these liggghts is 420 MB on a bare Debian, chromium and yade 2.1 GB)"
    log=$(mktemp)
    $as_root env DEBIAN_FRONTEND=noninteractive apt-get update -q >"$log" 2>&1 ||
        tail -n 3 "$log" >&2 # an unreachable foreign source must not stop us
    # shellcheck disable=SC2086  # a list of words
    $as_root env DEBIAN_FRONTEND=noninteractive \
        apt-get install -y -q --no-install-recommends $lacking >"$log" 2>&1 || {
        tail -n 5 "$log" >&2
        stop "apt-get could not install$lacking (its last words are above, all of them in $log)."
    }
    rm -f "$log"
fi

# --- Python packages -----------------------------------------------------------------------
# The stamp holds what the environment was made from, and where: a moved clone is set up again.
made_from="$PWD $extras $(cksum <pyproject.toml)"
stamp=".venv/trackbed-setup-${extras:-base}"
if [ "$(cat "$stamp" 2>/dev/null)" = "$made_from" ] && .venv/bin/python -c '' 2>/dev/null; then
    exit 0
fi
case ",$extras," in *,peers,*) size="4 GB" ;; *,bench,*) size="2 GB" ;; *) size="600 MB" ;; esac
echo "trackbed setup: installing Python packages into .venv, $size: trackbed${extras:+[$extras]} and" \
    "what it depends on (numpy, scipy, numba, matplotlib, ...; a minute or two)"
.venv/bin/python -m pip --version >/dev/null 2>&1 || "$python" -m venv --clear .venv || stop \
    "could not make .venv with $python (its words are above)."
.venv/bin/python -m pip install --quiet --disable-pip-version-check -e ".${extras:+[$extras]}" ||
    stop "pip could not install the Python packages (its words are above); is the network there?"
printf '%s' "$made_from" >"$stamp"
