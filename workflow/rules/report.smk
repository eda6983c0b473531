# The report on the study. A run that fails takes only what is made from it along: the report on
# the others is written all the same and lists it, and the call ends with an error.


# What is simulated, drawn from the first case of the study.
rule draw_set_up:
    output:
        f"results/{STUDY}/set_up.png",
    log:
        f"results/{STUDY}/logs/preview.log",
    benchmark:
        f"results/{STUDY}/benchmarks/preview.tsv"
    localrule: True
    conda:
        "../envs/python.yaml"
    params:
        case=SCENES["process"].digest(CASES[0]),
        fidelity=fidelity_option,
        study=STUDY,
        source=source_hash("dragdeck.preview.picture", "dragdeck.preview.layout"),
    shell:
        "dragdeck preview {params.study} {params.fidelity} > {log} 2>&1"


rule write_report:
    input:
        [every(name, "run.json", "tables/figures.json") for name in SCENES],
        [every_table(name) for name in SCENES],
        every("process", "tables/loading.json"),
        every("process", "network.html"),
        every("process", "tables/extrapolated.json"),
        advice=asked_advice("process"),
        set_up=rules.draw_set_up.output,
        templates=page_templates("report/report.html.j2"),
    output:
        csv=of_study("report", "summary.csv"),
        parquet=of_study("report", "summary.parquet"),
        xlsx=of_study("report", "summary.xlsx"),
        complete=touch(of_study("report", "complete")),
        page=report(
            of_study("report", "report.html"),
            caption="../report/report.rst",
            category="Report",
            labels={"run": "all", "figure": "report"},
        ),
    log:
        of_study("report", "logs/report.log"),
    benchmark:
        of_study("report", "benchmarks/report.tsv")
    conda:
        "../envs/python.yaml"
    params:
        runs=lambda wildcards: every_folder("process"),
        advice=advice_option,
        source=source_hash("dragchain.report.study_report"),
    shell:
        "dragchain report --out $(dirname {output.csv}) {params.runs} {params.advice}"
        " --preview {input.set_up} > {log} 2>&1"


INTERRUPTED = []


def interrupted(number, frame):
    """Note that the user stopped the workflow, and stop it as ever."""
    INTERRUPTED.append(number)
    signal.default_int_handler(number, frame)


# What will be run: as text, and as data for `--logger dragdeck`.
onstart:
    signal.signal(signal.SIGINT, interrupted)
    jobs, cores = list(workflow.dag.needrun_jobs()), workflow.cores or 1
    runs = planned_runs(jobs)
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
    # Not after Ctrl-C. The mark that the report is whole goes, so that the next call makes it anew.
    wanted = any(job.rule.name == "write_report" for job in workflow.dag.needrun_jobs())
    if wanted and not INTERRUPTED:
        runs = " ".join(folder for name in SCENES for folder in every_folder(name))
        advice = f"--advice {ADVICE}" if Path(ADVICE).is_file() else ""
        picture = f"results/{STUDY}/set_up.png"
        preview = f"--preview {picture}" if Path(picture).is_file() else ""
        shell(
            "rm -f results/{STUDY}/report/complete;"
            " dragchain report --out results/{STUDY}/report {runs} {advice} {preview} || true"
        )
        tell_numbers()
