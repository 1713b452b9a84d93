#!/bin/sh
# A SLURM of one node on this machine, all of it in one folder, for tests/engines/test_slurm.py:
#
#   apt-get install --no-install-recommends slurm-wlm munge libpmix-dev    # Debian 12: SLURM 22.05
#   export SLURM_CONF=FOLDER/slurm.conf
#   sh tests/engines/slurm_one_node.sh start FOLDER
#   pytest tests/engines/test_slurm.py
#   sh tests/engines/slurm_one_node.sh stop FOLDER
#
# (libpmix-dev holds the name under which SLURM looks for PMIx, which LIGGGHTS' MPI wants.)
# Key, socket and ports are its own: a SLURM that is there already is not touched.  Jobs run as who
# started it.  Two processors; no cgroups, which containers lack; ended jobs in FOLDER/jobs.txt.
set -eu
export PATH="$PATH:/usr/sbin:/sbin"
what=${1:?start or stop}
mkdir -p "${2:?a folder}"
folder=$(cd "$2" && pwd)

stop() {
    for daemon in slurmd slurmctld munged; do
        file="$folder/$daemon.pid"
        test -s "$file" || continue
        read -r pid <"$file"
        kill "$pid" 2>/dev/null || true
        for _ in $(seq 100); do
            kill -0 "$pid" 2>/dev/null || break
            sleep 0.1
        done
        kill -9 "$pid" 2>/dev/null || true # one that a lost step holds up
        rm -f "$file"
    done
}

start() {
    user=$(id -un)
    host=$(hostname -s)
    mkdir -p "$folder/state" "$folder/spool"
    chmod 755 "$folder"
    dd if=/dev/urandom of="$folder/munge.key" bs=1024 count=1 status=none
    chmod 600 "$folder/munge.key"
    cat >"$folder/slurm.conf" <<CONF
ClusterName=one
SlurmctldHost=$host
SlurmctldPort=16817
SlurmdPort=16818
SlurmUser=$user
SlurmdUser=$user
AuthType=auth/munge
AuthInfo=socket=$folder/munge.socket
CredType=cred/munge
StateSaveLocation=$folder/state
SlurmdSpoolDir=$folder/spool
SlurmctldPidFile=$folder/slurmctld.pid
SlurmdPidFile=$folder/slurmd.pid
SlurmctldLogFile=$folder/slurmctld.log
SlurmdLogFile=$folder/slurmd.log
ProctrackType=proctrack/linuxproc
TaskPlugin=task/none
SelectType=select/cons_tres
SelectTypeParameters=CR_CPU
SchedulerParameters=batch_sched_delay=1,sched_interval=2
JobAcctGatherType=jobacct_gather/none
AccountingStorageType=accounting_storage/none
JobCompType=jobcomp/filetxt
JobCompLoc=$folder/jobs.txt
ReturnToService=2
KillWait=2
NodeName=$host CPUs=2 RealMemory=$(awk '/MemTotal/ {print int($2 / 1024 * 0.9)}' /proc/meminfo)
PartitionName=one Nodes=ALL Default=YES State=UP
CONF
    export SLURM_CONF="$folder/slurm.conf"
    munged --force --key-file="$folder/munge.key" --socket="$folder/munge.socket" \
        --pid-file="$folder/munged.pid" --log-file="$folder/munged.log" \
        --seed-file="$folder/munge.seed"
    slurmctld -c
    slurmd
    for _ in $(seq 300); do
        sinfo -h -o %T 2>/dev/null | grep -q idle && return
        sleep 0.1
    done
    tail -n 5 "$folder"/*.log >&2
    exit 1
}

case $what in
    start) start ;;
    stop) stop ;;
    *) echo "start or stop?" >&2; exit 2 ;;
esac
