# Functions of ./run, in a clone and in a project that `dragdeck init` made. $root is its folder,
# where it works, $caller the folder of the call, and $shipped the one with dragdeck's files.

# A path that the caller gave is the caller's, not this folder's.
seen_from_here() {
    case $1 in
        /*) printf '%s\n' "$1" ;;
        */*) printf '%s\n' "$caller/$1" ;;
        *) printf '%s\n' "$1" ;;
    esac
}

if [ -n "${DRAGDECK_ENGINE:-}" ]; then
    DRAGDECK_ENGINE=$(seen_from_here "$DRAGDECK_ENGINE")
    export DRAGDECK_ENGINE
fi

say() { printf '%s\n' "run: $*" >&2; }

fail() {
    say "$1"
    shift
    for line in "$@"; do printf '     %s\n' "$line" >&2; done
    exit 1
}

# Results and .venv are made here.
ensure_writable() {
    [ -w "$root" ] || fail "this folder cannot be written to" "value:  $root" \
        "remedy: run it as the owner of the folder, or work in your own copy"
    free=$(df -Pk . 2>/dev/null | sed -n 's/^.* \([0-9][0-9]*\)  *[0-9]*%.*$/\1/p') || free=
    [ "${free:-10000}" -ge 10000 ] || fail "the disk is full" "value:  $free kB free" \
        "limit:  10000 kB" "remedy: free disk space, then give the same command again"
}

case " $* " in
    *" --profile profiles/slurm"* | *" --profile=profiles/slurm"*) fail \
        "this profile would be combined with profiles/default" \
        "value:  --profile profiles/slurm" "limit:  the cores of profiles/default would limit the MPI ranks of a run" \
        "remedy: --workflow-profile profiles/slurm" ;;
esac

# Run a command of a study.
call() {
    case $1 in
        compare) shift && call compared "$@" ;;
        search) shift && call searched "$@" ;;
        dragdeck | dragchain) exec "$@" ;;
        status | open) exec dragdeck "$@" ;;
        *)
            ensure_writable
            # Snakemake finds a logger plugin in folders of Python's path only, and a clone that is
            # installed has its packages in none of them.
            PYTHONPATH=$shipped/workflow${PYTHONPATH:+:$PYTHONPATH}
            export PYTHONPATH
            # A flag ends the list of loggers: a target may follow.
            exec snakemake --logger dragdeck --show-failed-logs "$@"
            ;;
    esac
}
