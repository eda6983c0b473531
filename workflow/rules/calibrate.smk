# The restitution that a measured drop test asks for, and the friction and rolling friction that
# measured angles ask for. A record that cannot be used is refused before any drop is run.


rule read_drop_record:
    input:
        WORK.drop_record,
    output:
        WORK.of_study("calibration", "record.json"),
    resources:
        prints=1,
    params:
        fall_time=WORK.fall_time_s,
        source=source_hash("dragchain.calibration.measured_impacts"),
    shell:
        "dragchain step record {input:q} --fall-time {params.fall_time} --out {output} 2>&1 | tee -i {log}"


rule sweep_drops:
    input:
        HOME,
        WORK.templates_of("drop_test"),
        WORK.of_study("calibration", "record.json"),
    output:
        WORK.of_study("calibration", "sweep/drops.json"),
    resources:
        prints=1,
    params:
        study=STUDY,
        whole=WORK.whole_study,
        fidelity=WORK.fidelity_option,
        source=source_hash("dragdeck.calibration_batches.restitution_drops"),
    shell:
        "dragdeck step drops {params.study} sweep {params.fidelity}"
        " --out $(dirname {output}) 2>&1 | tee -i {log}"


rule fit_restitution:
    input:
        record=WORK.drop_record,
        drops=WORK.of_study("calibration", "sweep/drops.json"),
    output:
        result=WORK.of_study("calibration", "result.json"),
        impacts=WORK.of_study("calibration", "impacts.csv"),
        bias=WORK.of_study("calibration", "bias.csv"),
    resources:
        prints=1,
    params:
        source=source_hash("dragchain.calibration.results"),
    shell:
        "dragchain step calibrate {input.record:q} --drops {input.drops}"
        " --out $(dirname {output.result}) 2>&1 | tee -i {log}"


rule confirm_restitution:
    input:
        HOME,
        WORK.templates_of("drop_test"),
        fit=WORK.of_study("calibration", "result.json"),
    output:
        WORK.of_study("calibration", "confirm/drops.json"),
    resources:
        prints=1,
    params:
        study=STUDY,
        whole=WORK.whole_study,
        fidelity=WORK.fidelity_option,
        source=source_hash("dragdeck.calibration_batches.restitution_drops"),
    shell:
        "dragdeck step drops {params.study} confirm {params.fidelity} --fit {input.fit}"
        " --out $(dirname {output}) 2>&1 | tee -i {log}"


rule simulate_angles:
    input:
        HOME,
        WORK.templates_of("angles"),
    output:
        WORK.of_study("calibration", "angles/runs.json"),
    threads: workflow.cores
    resources:
        prints=1,
    params:
        study=STUDY,
        whole=WORK.whole_study,
        fidelity=WORK.fidelity_option,
        source=source_hash("dragdeck.calibration_batches.angle_runs"),
    shell:
        "dragdeck step angles {params.study} {params.fidelity} --cores {threads}"
        " --out $(dirname {output}) 2>&1 | tee -i {log}"


rule fit_friction:
    input:
        rules.simulate_angles.output,
    output:
        result=WORK.of_study("calibration", "angles.json"),
        table=WORK.of_study("calibration", "angles.csv"),
    resources:
        prints=1,
    params:
        source=source_hash("dragchain.calibration.friction"),
    shell:
        "dragchain step angles {input} --out $(dirname {output.result}) 2>&1 | tee -i {log}"


rule write_calibration_report:
    input:
        WORK.if_measured(
            "record",
            *("result.json", "impacts.csv", "bias.csv", "sweep/drops.json", "confirm/drops.json"),
        ),
        record=WORK.drop_record,
        angles=WORK.if_measured("angles", "angles.json", "angles.csv"),
        templates=WORK.page_templates("calibration/calibration.html.j2"),
    output:
        WORK.if_measured("record", "figures/impacts.png"),
        WORK.if_measured("angles", "figures/angles.png"),
        page=shown(
            WORK.of_study("calibration", "report.html"),
            "calibration",
            "Calibration",
            run="calibration",
        ),
    resources:
        prints=1,
    params:
        source=source_hash("dragchain.calibration.report"),
        angles=lambda wildcards, input: "--angles" if input.angles else "",
    shell:
        "dragchain step calibration-report $(dirname {output.page}) {params.angles}"
        " --record {input.record:q} 2>&1 | tee -i {log}"
