# Verification of the contact law on the engine: single impacts and a few particles.


# Many runs of seconds in one job; a job that is interrupted goes on where it was.
rule judge_verification:
    input:
        WORK.templates_of("collide"),
        page=WORK.page_templates("verification/verification.html.j2", package="evidence"),
        suite=["evidence/verification/suite.yaml", "evidence/verification/published.csv"],
    output:
        multiext(
            "results/verification/report/",
            "checks.csv",
            "checks.parquet",
            "verification.csv",
            "verification.parquet",
        ),
        page=shown("results/verification/report/verification.html", "verification", "Verification"),
    threads: 4
    resources:
        prints=1,
    params:
        study=STUDY,
        fidelity=WORK.fidelity_option,
        cases=[scene.digest(CASES[0]) for scene in SCENES.values()],
        source=source_hash("evidence.verification.report"),
    shell:
        "python -m evidence verify {params.study} {params.fidelity} --cores {threads}"
        " --out $(dirname {output.page}) 2>&1 | tee -i {log}"


# Fails if a quantity failed, and leaves the report to look at.
rule pass_verdict:
    input:
        "results/verification/report/verification.parquet",
    output:
        "results/verification/report/verdict.txt",
    localrule: True
    params:
        source=source_hash("evidence.verification.report"),
    shell:
        "python -m evidence verdict $(dirname {input}) > {output} 2> {log}"
