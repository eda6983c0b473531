# From a study file to decks, runs, tables and a report.
#   snakemake all --config study=uhlmann2015 fidelity=standard
from snakemake.utils import min_version

min_version("9.0")


include: "workflow/rules/common.smk"
include: "workflow/rules/decks.smk"
include: "workflow/rules/advise.smk"
include: "workflow/rules/simulate.smk"
include: "workflow/rules/tables.smk"
include: "workflow/rules/network.smk"
include: "workflow/rules/removal.smk"
include: "workflow/rules/report.smk"
include: "workflow/rules/export.smk"
include: "workflow/rules/calibrate.smk"
include: "workflow/rules/verify.smk"
include: "workflow/rules/stability.smk"
include: "workflow/rules/points.smk"
include: "workflow/rules/trade.smk"
include: "workflow/rules/validate.smk"
include: "workflow/rules/scaling.smk"


# With a queue, these stay where snakemake runs: they take a second or two.
localrules:
    all,
    calibrate,
    checks,
    drop,
    export,
    fill,
    pass_verdict,
    process,
    render_drop,
    render_fill,
    render_point,
    render_process,
    render_verification,
    report,
    scaling,
    stability,
    trade,
    validate,
    verify,


# The whole study: runs, tables, chains, figures and the report.
rule all:
    default_target: True
    input:
        rules.write_report.output,
        every("drop", "figures/drop.png"),
        every("fill", "figures/fill.png"),


# The drop tests.
rule drop:
    input:
        every("drop", "tables/impacts.parquet"),


# The settled beds.
rule fill:
    input:
        every("fill", "tables/fill.json"),


# The process runs with their tables.
rule process:
    input:
        every("process", "tables/rod_force.parquet"),


# summary.csv, summary.parquet and report.html.
rule report:
    input:
        rules.write_report.output,


# The process runs as time series for ParaView and OVITO.
rule export:
    input:
        every("process", "export/paraview/run.pvd"),


# The restitution that a measured drop test asks for.
rule calibrate:
    input:
        rules.write_calibration_report.output,


# The contact law against exact formulae and published impacts.
rule verify:
    input:
        rules.judge_verification.output,
        rules.pass_verdict.output,


# The map of stable and unstable time steps.
rule stability:
    input:
        rules.write_stability.output,


# What speed costs in accuracy: the points of a plan against the reference.
rule trade:
    input:
        rules.write_trade.output,


# Whether the advisor's promises hold on other scenes: --config plan=checks
rule checks:
    input:
        rules.write_checks.output,


# The study beside its source: several fills, a control, what is assumed.
rule validate:
    input:
        rules.write_validation.output,


# How the mean drag depends on the field that the study's block scaling names.
rule scaling:
    input:
        rules.write_scaling.output,
