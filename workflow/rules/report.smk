# The report on the study. A run that fails takes only what is made from it along: the report on
# the others is written all the same and lists it, and the call ends with an error.


# What is simulated, drawn from the first case of the study.
rule draw_set_up:
    input:
        HOME,
    output:
        f"results/{STUDY}/set_up.png",
    localrule: True
    params:
        study=STUDY,
        case=SCENES["process"].digest(CASES[0]),
        fidelity=WORK.fidelity_option,
        source=source_hash("dragdeck.preview.picture"),
    shell:
        "dragdeck step set-up {params.study} {params.fidelity} > {log} 2>&1"


rule write_report:
    input:
        [WORK.every(name, "run.json", "tables/findings.json") for name in SCENES],
        [WORK.every_table(name) for name in SCENES],
        WORK.every("process", "tables/loading.json", "tables/quantities.json"),
        WORK.every("process", "network.html"),
        WORK.every("process", "tables/extrapolated.json"),
        advice=WORK.needed_advice,
        home=HOME,
        signal=WORK.signal_file(),
        set_up=rules.draw_set_up.output,
        templates=WORK.page_templates("report/report.html.j2"),
    output:
        csv=WORK.of_study("report", "summary.csv"),
        parquet=WORK.of_study("report", "summary.parquet"),
        xlsx=WORK.of_study("report", "summary.xlsx"),
        complete=WORK.of_study("report", "complete"),
        page=shown(WORK.of_study("report", "report.html"), "report", "Report"),
    params:
        runs=lambda wildcards: WORK.every_folder("process"),
        signal=WORK.signal_option,
        state=PROJECT.state(CASES),
        source=source_hash("dragchain.report.study_report"),
    shell:
        "dragchain report --out $(dirname {output.csv}) {params.runs} {params.signal}"
        " --preview {input.set_up} > {log} 2>&1"
        " && echo {params.state} > {output.complete}"


# What will be run: as text, and as data for `--logger dragdeck`.
onstart:
    signal.signal(signal.SIGINT, interrupted)
    jobs, cores = list(workflow.dag.needrun_jobs()), workflow.cores or 1
    runs = WORK.planned_runs(jobs)
    plan = plan_in_words(runs, cores)
    if plan:
        plan[0] += f"; {shown_bytes(free_bytes(PROJECT.root))} free"
    others = f"{len(jobs) - len(runs)} {'other jobs' if runs else 'jobs'}"
    plan.append(f"{others} (their time is not estimated)")
    text = f"{STUDY}: " + "\n  ".join(plan)
    logger.info(text, extra={"shown": True, "plan": runs, "cores": cores})


onsuccess:
    if any(job.rule.name == "write_report" for job in workflow.dag.jobs):
        tell_numbers()


onerror:
    # Not after Ctrl-C. An earlier report goes, of which nothing is to be shown.
    wanted = any(job.rule.name == "write_report" for job in workflow.dag.needrun_jobs())
    if wanted and not INTERRUPTED:
        runs = " ".join(folder for name in SCENES for folder in WORK.every_folder(name))
        picture = f"results/{STUDY}/set_up.png"
        preview = f"--preview {picture}" if Path(picture).is_file() else ""
        measured = WORK.signal_option()
        shell(
            "rm -f results/{STUDY}/report/{{complete,report.html,summary.*}};"
            " dragchain report --out results/{STUDY}/report {runs} {preview} {measured} || true"
        )
        tell_numbers()
