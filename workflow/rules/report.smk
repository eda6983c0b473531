# The report on the study. A run that fails takes only what is made from it along: the report on
# the others is written all the same and lists it, and the call ends with an error.


# What is simulated, drawn from the first case of the study.
rule draw_set_up:
    input:
        home,
    output:
        "results/{study}/set_up.png",
    localrule: True
    params:
        case=lambda wildcards: SCENES["process"].digest(WORK.of(wildcards.study).cases[0]),
        fidelity=WORK.fidelity_option,
        source=source_hash("dragdeck.preview.picture"),
    shell:
        "dragdeck step set-up {wildcards.study} {params.fidelity} > {log} 2>&1"


rule write_report:
    input:
        lambda wildcards: WORK.of(wildcards.study).of_report(),
        home=home,
        signal=lambda wildcards: WORK.of(wildcards.study).signal_file(),
        set_up=rules.draw_set_up.output,
        templates=WORK.page_templates("report/report.html.j2"),
    output:
        multiext("results/{study}/report/summary.", "csv", "parquet", "xlsx"),
        complete="results/{study}/report/complete",
        page=shown("results/{study}/report/report.html", "report", "Report"),
    params:
        runs=lambda wildcards: WORK.of(wildcards.study).every_folder("process"),
        signal=lambda wildcards: WORK.of(wildcards.study).signal_option(),
        state=lambda wildcards: PROJECT.state(WORK.of(wildcards.study).cases),
        source=source_hash("dragchain.report.study_report"),
    shell:
        "dragchain report --out $(dirname {output.page}) {params.runs} {params.signal}"
        " --preview {input.set_up} > {log} 2>&1"
        " && echo {params.state} > {output.complete}"


# What will be run: as text, and as data for `--logger dragdeck`.
onstart:
    signal.signal(signal.SIGINT, interrupted)
    jobs, cores = list(workflow.dag.needrun_jobs()), workflow.cores or 1
    WORK.check_raw_outputs(jobs)
    runs = WORK.planned_runs(jobs)
    plan = plan_in_words(runs, cores)
    if plan:
        plan[0] += f"; {shown_bytes(free_bytes(PROJECT.root))} free"
    others = f"{len(jobs) - len(runs)} {'other jobs' if runs else 'jobs'}"
    plan.append(f"{others} (their time is not estimated)")
    text = f"{', '.join(STUDIES)}: " + "\n  ".join(plan)
    logger.info(text, extra={"shown": True, "plan": runs, "cores": cores})


onsuccess:
    for study in reported(workflow.dag.jobs):
        tell_numbers(study)


onerror:
    # Not after Ctrl-C. An earlier report goes, of which nothing is to be shown.
    for study in [] if INTERRUPTED else reported(workflow.dag.needrun_jobs()):
        runs = " ".join(
            folder for name in SCENES for folder in WORK.of(study).every_folder(name)
        )
        picture = f"results/{study}/set_up.png"
        preview = f"--preview {picture}" if Path(picture).is_file() else ""
        measured = WORK.of(study).signal_option()
        shell(
            "rm -f results/{study}/report/{{complete,report.html,summary.*}};"
            " dragchain report --out results/{study}/report {runs} {preview} {measured} || true"
        )
        tell_numbers(study)
