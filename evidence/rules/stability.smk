# The stability map: a job a regime, each with many small runs. A run that fails
# is a finding; a batch that is interrupted goes on where it was.

from evidence.stability.points import bed_settings

STABILITY_MAP = config["stability_map"]

# Folders of the fillings that columns and drags start from; none without a map.
STABILITY_BEDS = [
    run_path("stability", "filling", name)
    for name in (
        or_stop(bed_settings, Path(STABILITY_MAP)) if Path(STABILITY_MAP).is_file() else []
    )
]


# These fillings are no cases of the study: they differ in their materials.
ruleorder: settle_beds > run_filling


# Beds that columns and drags start from; tabulated as every filling.
rule settle_beds:
    input:
        points=STABILITY_MAP,
        study="studies/stability/study.yaml",
        templates=WORK.files("templates/*.j2"),
    output:
        [f"{bed}/run.json" for bed in STABILITY_BEDS],
    resources:
        prints=1,
    params:
        source=source_hash("evidence.stability.runs"),
    shell:
        "python -m evidence run-map beds --map {input.points:q} 2>&1 | tee -i {log}"


rule run_regime:
    input:
        points=STABILITY_MAP,
        study="studies/stability/study.yaml",
        templates=WORK.files("templates/*.j2"),
        beds=lambda wildcards: (
            [f"{bed}/tables/packing.json" for bed in STABILITY_BEDS]
            if wildcards.regime in ("column", "drag")
            else []
        ),
    output:
        "results/stability/points/{regime}.json",
    wildcard_constraints:
        regime="impact|settle|column|drag",
    resources:
        prints=1,
    params:
        source=source_hash("evidence.stability.runs"),
    shell:
        "python -m evidence run-map {wildcards.regime} --map {input.points:q} 2>&1 | tee -i {log}"


rule write_stability:
    input:
        lists=expand(
            "results/stability/points/{regime}.json",
            regime=["impact", "settle", "column", "drag"],
        ),
        templates=WORK.page_templates("stability/stability.html.j2", package="evidence"),
    output:
        page=shown("results/stability/report.html", "stability", "Stability", "stability"),
        tables=multiext("results/stability/", "points.csv", "points.parquet"),
        conditions=multiext("results/stability/", "conditions.csv", "conditions.parquet"),
        measured="results/stability/stability.json",
    params:
        source=source_hash("evidence.stability.report"),
    shell:
        "python -m evidence report-map --out $(dirname {output.page}) {input.lists} > {log} 2>&1"
