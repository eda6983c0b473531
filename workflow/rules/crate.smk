# A study's inputs, runs and report as an RO-Crate, to archive and to cite.


def crate_inputs(wildcards=None):
    """Study files, templates and meshes of all scenes."""
    files = explained(study_files, CASES)
    templates = (file for scene in SCENES for file in templates_of(scene))
    return list(dict.fromkeys([*(str(relative(file)) for file in files), *templates]))


def licence_option(wildcards=None):
    """How to name the licence of the results on the command line, if the study states one."""
    licence = CASES[0].study.licence
    return quote(f"--licence={licence}") if licence else ""


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
        licence=licence_option,
        source=source_hash("dragchain.report.crate"),
    shell:
        "dragchain step crate --out $(dirname {output}) --report {params.report} {params.licence}"
        " --inputs {input.files:q} -- {params.runs} > {log} 2>&1"
