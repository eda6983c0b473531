# From a study file to decks, runs, tables and a report.
#   snakemake all --config study=uhlmann2015 fidelity=standard
from snakemake.utils import min_version

min_version("9.0")


include: "workflow/rules/common.smk"
include: "workflow/rules/runs.smk"
include: "workflow/rules/advise.smk"
include: "workflow/rules/network.smk"
include: "workflow/rules/report.smk"
include: "workflow/rules/export.smk"
include: "workflow/rules/crate.smk"
include: "workflow/rules/calibrate.smk"
include: "workflow/rules/verify.smk"
include: "workflow/rules/stability.smk"
include: "workflow/rules/tradeoff.smk"
include: "workflow/rules/validate.smk"
include: "workflow/rules/scaling.smk"


# Logs, benchmarks and the environment: alike for all rules.
add_records(workflow.rules)


# The whole study: runs, tables, chains, figures and the report.
rule all:
    default_target: True
    input:
        rules.write_report.output,
        [
            WORK.every(name, *(f"figures/{figure}.png" for figure in figures_of(name)))
            for name, scene in SCENES.items()
        ],


# The drop tests.
rule drop_test:
    input:
        WORK.every_table("drop_test"),


# The settled packings.
rule filling:
    input:
        WORK.needed_advice,
        WORK.every_table("filling"),


# The process runs with their tables.
rule process:
    input:
        WORK.needed_advice,
        WORK.every_table("process"),


# What a search reads of the settings so far: ./run search calls this round by round.
rule searched:
    input:
        WORK.needed_advice,
        WORK.every("process", "run.json", "tables/findings.json", "tables/loading.json"),
        WORK.every("process", "tables/extrapolated.json"),
        WORK.every("filling", "run.json", "tables/findings.json"),


# summary.csv, summary.parquet, summary.xlsx and report.html.
rule report:
    input:
        rules.write_report.output,


# The figures of the process runs for a publication: SVG, PDF and PNG at the widths of columns.
rule figures:
    input:
        WORK.every("process", "figures/journal/workpiece.pdf"),


# The process runs as time series for ParaView and OVITO.
rule export:
    input:
        WORK.every("process", "export/paraview/run.pvd"),


# The study's inputs, runs and report as an RO-Crate.
rule crate:
    input:
        rules.write_crate.output,


# Fit of coefficients to a measured drop test, to measured angles, or to both.
rule calibrate:
    input:
        rules.write_calibration_report.output,


# The contact law, compared with exact formulae and published impacts.
rule verify:
    input:
        rules.judge_verification.output,
        rules.pass_verdict.output,


# The map of stable and unstable time steps.
rule stability:
    input:
        rules.write_stability.output,


# The speed-accuracy trade-off: the points of a plan relative to the reference.
rule tradeoff:
    input:
        rules.write_tradeoff.output,


# Comparison with the publication: several packings, a control, assumptions.
rule validate:
    input:
        rules.write_validation.output,


# Mean drag as a function of the field in the study's block scaling.
rule scaling:
    input:
        rules.write_scaling.output,
