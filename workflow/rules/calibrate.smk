# The restitution that a measured drop test gives, and the friction and rolling friction that
# measured angles give.


# Many short runs in one job; a job that is interrupted goes on where it was.
rule fit_coefficients:
    input:
        HOME,
        WORK.templates_of("drop_test"),
        WORK.templates_of("angles"),
        record=WORK.drop_record,
        templates=WORK.page_templates("calibration/calibration.html.j2"),
    output:
        WORK.if_measured(
            "record",
            *("result.json", "impacts.csv", "impacts.parquet", "bias.csv", "bias.parquet"),
            "figures/impacts.png",
        ),
        WORK.if_measured(
            "angles", "angles.json", "angles.csv", "angles.parquet", "figures/angles.png"
        ),
        page=shown(
            WORK.of_study("calibration", "report.html"),
            "calibration",
            "Calibration",
            run="calibration",
        ),
    threads: min(workflow.cores, or_stop(cores_here))
    resources:
        prints=1,
    params:
        study=STUDY,
        whole=WORK.whole_study,
        fidelity=WORK.fidelity_option,
        source=source_hash("dragchain.calibration.report"),
    shell:
        "dragchain step calibrate {params.study} {params.fidelity} --cores {threads}"
        " --out $(dirname {output.page}) 2>&1 | tee -i {log}"
