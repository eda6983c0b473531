# Verification of the contact law on the engine: single impacts and a few particles.

VERIFICATION_RUNS = list(suite_of(CASES[0].study))


rule render_verification:
    input:
        templates_of("collide"),
        suite="evidence/verification/suite.yaml",
    output:
        [
            of_experiment(run, file)
            for run in VERIFICATION_RUNS
            for file in ("in.liggghts", "case.json", "columns.json", "bodies.data")
        ],
    log:
        "results/verification/logs/render.log",
    benchmark:
        "results/verification/benchmarks/render.tsv"
    conda:
        "../envs/python.yaml"
    params:
        study=STUDY,
        fidelity=fidelity_option,
        source=source_hash("evidence.verification.suite"),
    shell:
        "python -m evidence render-suite {params.study} {params.fidelity} > {log} 2>&1"


rule run_verification:
    input:
        of_experiment("{run}", "in.liggghts"),
        of_experiment("{run}", "case.json"),
        of_experiment("{run}", "columns.json"),
        of_experiment("{run}", "bodies.data"),
    output:
        of_experiment("{run}", "run.json"),
    log:
        of_experiment("{run}", "logs/run.log"),
    benchmark:
        of_experiment("{run}", "benchmarks/run.tsv")
    conda:
        "../envs/python.yaml"
    resources:
        engine=1,
    params:
        source=source_hash("dragdeck.engine.run_folder"),
    shell:
        "dragdeck run $(dirname {output}) > {log} 2>&1"


rule judge_verification:
    input:
        [of_experiment(run, "run.json") for run in VERIFICATION_RUNS],
        templates=page_templates(
            "verification/verification.html.j2", "verification/tests.html.j2", package="evidence"
        ),
        published="evidence/verification/published.csv",
    output:
        multiext(
            "results/verification/report/",
            "checks.csv",
            "checks.parquet",
            "verification.csv",
            "verification.parquet",
        ),
        page=report(
            "results/verification/report/verification.html",
            caption="../report/verification.rst",
            category="Verification",
            labels={"run": "all", "figure": "report"},
        ),
    log:
        "results/verification/logs/judge.log",
    benchmark:
        "results/verification/benchmarks/judge.tsv"
    conda:
        "../envs/python.yaml"
    params:
        runs=[of_experiment(run, "") for run in VERIFICATION_RUNS],
        source=source_hash("evidence.verification.report"),
    shell:
        "python -m evidence judge-suite --out $(dirname {output.page}) {params.runs} > {log} 2>&1"


# Fails if a quantity failed, and leaves the report to look at.
rule pass_verdict:
    input:
        "results/verification/report/verification.parquet",
    output:
        "results/verification/report/verdict.txt",
    log:
        "results/verification/logs/verdict.log",
    benchmark:
        "results/verification/benchmarks/verdict.tsv"
    conda:
        "../envs/python.yaml"
    params:
        source=source_hash("evidence.verification.report"),
    shell:
        "python -m evidence verdict $(dirname {input}) > {output} 2> {log}"
