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

usage_of_studies() {
    cat "$shipped/workflow/usage.txt"
}

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

check_profile() {
    case " $* " in
        *" --profile profiles/slurm"* | *" --profile=profiles/slurm"*) fail \
            "this profile would be combined with profiles/default" \
            "value:  --profile profiles/slurm" "limit:  the cores of profiles/default would limit the MPI ranks of a run" \
            "remedy: --workflow-profile profiles/slurm" ;;
    esac
}

# The letters of a word such as -np; those behind one that takes a value belong to the value.
letters_of() {
    case $1 in --* | -) return ;; -*) ;; *) return ;; esac
    letters=${1#-}
    printf '%s' "${letters%%[sjcCePRqwT]*}"
}

is_dry_run() {
    for word in "$@"; do
        case $word in --dry*) return 0 ;; esac
        case $(letters_of "$word") in *n*) return 0 ;; esac
    done
    return 1
}

# Results would be written elsewhere, where this script does not look for them.
refuse_elsewhere() {
    for word in "$@"; do
        letters=$(letters_of "$word")
        case $word:$letters in
            --dir*:* | *:*d*) fail "results are written to the folder of this script" "value:  $word" \
                "remedy: copy the project, or make one there with: dragdeck init FOLDER" ;;
        esac
    done
}

# Options with which Snakemake runs nothing, or not all, and those letters that are short for one.
partial_options="--allowed-rules --archive --batch --cleanup-metadata --cleanup-shadow --cm
    --conda-cleanup-envs --conda-create-envs-only --container-cleanup-images --containerize --d3dag
    --dag --delete-all-output --delete-temp-output --detailed-summary --draft-notebook
    --edit-notebook --export-cwl --filegraph --generate-unit-tests --help --immediate-submit --is
    --lc --li --lint --list --list-changes --list-conda-envs --list-input-changes
    --list-params-changes --list-rules --list-target-rules --list-untracked --lp --lt --lu --mode
    --omit-from --print-compilation --report --rulegraph --summary --target-jobs --touch --unlock
    --until --version"
partial_letters=DOSUhltv

# Refuse them, abbreviated too: the next step would not come.
refuse_partial() {
    for word in "$@"; do
        refused=
        case $(letters_of "$word") in *[$partial_letters]*) refused=$word ;; esac
        case $word in
            --?*) for option in $partial_options; do
                case $option in "${word%%=*}"*) refused=$word ;; esac
            done ;;
        esac
        [ -z "$refused" ] || fail "this option runs nothing, or not all of it" "value:  $word" \
            "remedy: leave it out, or give it with a target of one study: ./run report"
    done
}

# Every study of a list, each to its report, and then their cases side by side.
compare_studies() {
    refuse_partial "$@"
    studies=
    for word in "$@"; do
        case $word in studies=*) studies=${word#studies=} ;; esac
    done
    [ -n "$studies" ] || fail "no studies to compare" \
        "remedy: ./run compare --config studies=A,B, or studies=A for the cases of a sweep"
    case $studies in
        *[!A-Za-z0-9._,-]*) fail "not names of studies" "value:  $studies" \
            "remedy: give names of folders of studies/, separated by commas" ;;
    esac
    folders=
    for study in $(printf '%s' "$studies" | tr , ' '); do
        say "study $study"
        # No argument of a study holds a space.
        # shellcheck disable=SC2046
        "$root/run" all $(printf '%s\n' "$@" | sed "1d;s/^studies=.*/study=$study/") || return 1
        folders="$folders results/$study"
    done
    if is_dry_run "$@"; then return 0; fi
    out=results/compare/$(printf '%s' "$studies" | tr , +)
    # No name of a study holds a space.
    # shellcheck disable=SC2086
    dragchain compare --out "$out" $folders && say "$out/comparison.html"
}

# Round by round: the next settings, and their runs. A run that failed is a finding.
search_setting() {
    refuse_partial "$@"
    study=
    for word in "$@"; do
        case $word in
            study=*) study=${word#study=} ;;
            fidelity=*) fail "a search has the fidelity of its study" "value:  $word" \
                "remedy: set fidelity in the study" ;;
        esac
    done
    [ -n "$study" ] || study=$(sed -n -E "s/^study: *[\"']?([A-Za-z0-9._-]+).*/\1/p" config/config.yaml)
    shift
    status=0 before=
    while :; do
        state=$(dragchain step search "$study") || return 1
        [ "$state" != complete ] || break
        [ "$state" != unfinished ] || [ "$status" -eq 0 ] || return "$status"
        [ "$before$state" != unfinishedunfinished ] || fail "the runs of this round are not made" \
            "remedy: see which jobs there are with: ./run searched --dry-run --config study=$study"
        status=0 before=$state
        "$root/run" searched "$@" || status=$?
        if is_dry_run "$@"; then return "$status"; fi
    done
    say "results/$study/search/search.html"
}

# Run a command of a study.
call() {
    case $1 in
        compare) compare_studies "$@" ;;
        search) search_setting "$@" ;;
        dragdeck | dragchain) exec "$@" ;;
        status | open) exec dragdeck "$@" ;;
        *)
            refuse_elsewhere "$@"
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
