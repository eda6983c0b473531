# A study's inputs, runs and report as an RO-Crate, to archive and to cite.


def crate_inputs(wildcards=None):
    """Study files, templates and meshes of all scenes."""
    files = explained(study_files, CASES)
    templates = (file for scene in SCENES for file in templates_of(scene))
    return list(dict.fromkeys([*(str(relative(file)) for file in files), *templates]))


def crate_options(wildcards=None):
    """Licence and extent of the crate, as options of the command line."""
    licence = CASES[0].study.licence
    options = [f"--licence={licence}"] if licence else []
    return " ".join(quote(option) for option in [*options, *CRATE_EXTENTS[CRATE]])


rule write_crate:
    input:
        rules.write_report.output,
        [every(name, "run.json", "tables/figures.json") for name in SCENES],
        files=crate_inputs,
    output:
        of_study("crate", "ro-crate-metadata.json"),
    log:
        of_study("logs", "crate.log"),
    benchmark:
        of_study("benchmarks", "crate.tsv")
    conda:
        "../envs/python.yaml"
    params:
        runs=[folder for name in SCENES for folder in every_folder(name)],
        report=of_study("report", ""),
        options=crate_options,
        source=source_hash("dragchain.report.crate"),
    shell:
        "dragchain step crate --out $(dirname {output}) --report {params.report} {params.options}"
        " --inputs {input.files:q} -- {params.runs} > {log} 2>&1"
