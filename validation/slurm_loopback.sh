#!/bin/sh
# One-node Slurm on this machine, for make validate-slurm. Debian: apt-get install slurmctld slurmd slurm-client munge
# Usage, as root: sh slurm_loopback.sh start|stop FOLDER. Then: export SLURM_CONF=FOLDER/slurm.conf
set -eu
action=$1
root=$2
stop() {
    for name in slurmd slurmctld munged; do
        if [ -f "$root/$name.pid" ]; then kill "$(cat "$root/$name.pid")" 2>/dev/null || true; rm -f "$root/$name.pid"; fi
    done
}
if [ "$action" = stop ]; then stop; exit 0; fi
mkdir -p "$root/state" "$root/spool" "$root/munge"
chmod 755 "$root"
chmod 700 "$root/munge"
# A key and a socket of its own: the machine's munge, if there is one, is left alone.
[ -f "$root/munge/munge.key" ] || dd if=/dev/urandom of="$root/munge/munge.key" bs=1024 count=1 2>/dev/null
chmod 400 "$root/munge/munge.key"
node=$(hostname -s)
cores=$(nproc)
memory=$(awk '/MemTotal/ {print int($2 / 1024 * 0.9)}' /proc/meminfo)
cat > "$root/slurm.conf" <<CONF
ClusterName=loopback
SlurmctldHost=$node(127.0.0.1)
SlurmctldPort=16817
SlurmdPort=16818
SlurmUser=root
AuthType=auth/munge
AuthInfo=socket=$root/munge/munge.socket
CredType=cred/munge
StateSaveLocation=$root/state
SlurmdSpoolDir=$root/spool
SlurmctldPidFile=$root/slurmctld.pid
SlurmdPidFile=$root/slurmd.pid
SlurmctldLogFile=$root/slurmctld.log
SlurmdLogFile=$root/slurmd.log
ProctrackType=proctrack/linuxproc
TaskPlugin=task/none
JobAcctGatherType=jobacct_gather/none
AccountingStorageType=accounting_storage/none
MpiDefault=none
ReturnToService=2
SwitchType=switch/none
SelectType=select/cons_tres
SelectTypeParameters=CR_Core
SchedulerType=sched/backfill
SchedulerParameters=batch_sched_delay=0,bf_interval=2
NodeName=$node NodeAddr=127.0.0.1 CPUs=$cores RealMemory=$memory State=UNKNOWN
PartitionName=short Nodes=$node Default=YES MaxTime=01:00:00 State=UP
CONF
munged --force --key-file="$root/munge/munge.key" --socket="$root/munge/munge.socket" \
    --pid-file="$root/munged.pid" --log-file="$root/munge/munged.log" --seed-file="$root/munge/seed"
slurmctld -f "$root/slurm.conf"
slurmd -f "$root/slurm.conf"
for _ in $(seq 30); do
    if SLURM_CONF="$root/slurm.conf" sinfo -h -o %T 2>/dev/null | grep -q idle; then exit 0; fi
    sleep 0.5
done
echo "the node is not idle; see $root/slurmctld.log and $root/slurmd.log" >&2
exit 1
