//! The question of a plant: which joint of which robot has changed most since March?

use super::database::Postgres;
use super::plant::prepare;

/// Robots of six joints with one finding a day from January on; joint 3 of the robot `r7` loses 12 % when three quarters of the days are over.
fn the_joint_that_changed_most_is_found(robots: usize, days: usize) {
    let folder = tempfile::tempdir().unwrap();
    let postgres = Postgres::start_in(folder.path());
    prepare(folder.path(), &postgres, 1);
    postgres.ask(&format!(
        "set synchronous_commit = off;
         insert into robot (site, robot, box, sent) select 'hall', 'r' || robot, 'b', {days} from generate_series(1, {robots}) as robot;
         insert into finding (site, robot, sequence, sha256, box, found_at, schema, body, joints, log_values, log_stds, verdicts)
         select 'hall', 'r' || robot, day, md5(robot || ' ' || day), 'b', '2026-01-01'::timestamptz + day * interval '1 day', 2, '{{}}',
             array['joint_1', 'joint_2', 'joint_3', 'joint_4', 'joint_5', 'joint_6'],
             (select array_agg(18 + 0.01 * sin(robot + day + place) + case when robot = 7 and day > {days} * 0.75 and place = 29 then ln(0.88) else 0 end
                 order by place) from generate_series(1, 72) as place),
             array_fill(0.01::float8, array[72]), array_fill('identified'::text, array[72])
         from generate_series(1, {days}) as day, generate_series(1, {robots}) as robot;
         analyze"
    ));
    let question = "select robot, joint, axis, kind, round(percent) from change('2026-03-01') order by abs(percent) desc limit 1";
    let told = postgres.ask(question);
    assert!(told.starts_with("r7|joint_3|ry|stiffness|-1"), "{told}");
    // By the index, two findings of each robot: the others are not read.
    let plan = postgres.ask(&format!("explain analyze {question}"));
    assert_eq!(plan.matches("using finding_by_time on finding").count(), 2, "{plan}");
    assert!(!plan.contains("Seq Scan on finding"), "{plan}");
    let time = plan.lines().find(|line| line.starts_with("Execution Time")).unwrap();
    println!("{robots} robots with {days} findings each: {time}");
}

#[test]
fn the_joint_that_changed_most_of_a_hundred_robots_is_found() {
    the_joint_that_changed_most_is_found(100, 100);
}

/// `tests/run --full` has this one.
#[test]
#[ignore = "a minute, 1 GB"]
fn the_joint_that_changed_most_of_a_thousand_robots_is_found() {
    the_joint_that_changed_most_is_found(1000, 365);
}
