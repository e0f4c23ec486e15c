-- Findings of a fleet. Whoever inserts a message of the broker into the view `message` fills the tables; nobody needs another right.

create table finding (
    site text not null,
    robot text not null,
    sequence bigint not null,
    -- Of the message: what is delivered twice is one row, and two boxes with one name lose nothing.
    sha256 text not null,
    box text not null,
    boot_id text,
    found_at timestamptz not null,
    begun timestamptz,
    synchronised boolean,
    received_at timestamptz not null default now(),
    schema integer not null,
    acceptance text,
    model_sha256 text,
    config_sha256 text,
    tool text,
    body jsonb not null,
    -- Twelve parameters of each joint, first stiffness, then damping, each along and about x, y and z: natural logarithm, standard deviation
    -- of those that are identified, verdict. In arrays, since a row for each parameter takes ten times the room.
    joints text[],
    log_values double precision[],
    log_stds double precision[],
    verdicts text[],
    primary key (site, robot, sequence, sha256)
);
create index finding_by_time on finding (site, robot, found_at, sequence);
create index on finding (site, robot, received_at);
create index on finding (site, robot, box, sequence);

create table robot (
    site text not null,
    robot text not null,
    online boolean,
    daemon boolean,
    tool text,
    told_at timestamptz,
    -- The outbox, and the sequence up to which it has sent its findings.
    box text,
    sent bigint not null default 0,
    -- For people: type, serial number, day of installation.
    type text,
    serial text,
    installed date,
    primary key (site, robot)
);

-- What happens to a robot: noted by people (gear changed, collision, recalibrated), or here (another model, box or gap).
create table event (
    site text not null,
    robot text not null,
    at timestamptz not null default now(),
    what text not null
);
create index on event (site, robot, at);

-- Messages that are no findings. Nothing is thrown away.
create table refused (
    received_at timestamptz not null default now(),
    topic text not null,
    why text not null,
    payload bytea not null,
    sha256 bytea generated always as (sha256(payload)) stored,
    primary key (topic, sha256)
);

-- Findings that a box has sent and that are not there: of the newest 1000, which is what an outbox keeps.
create view gap as
select site, robot, box, missing from robot, generate_series(greatest(1, sent - 999), sent) as missing
where not exists (
    select from finding where (finding.site, finding.robot, finding.box) = (robot.site, robot.robot, robot.box) and sequence = missing);

-- Takes note of the outbox that a robot has, and how far it has come.
create function take_sent(own_site text, own_robot text, own_box text, own_sent bigint) returns void language sql as $$
    insert into robot (site, robot, box, sent) values (own_site, own_robot, own_box, coalesce(own_sent, 0))
    on conflict (site, robot) do update set
        box = excluded.box, sent = case when robot.box = excluded.box then greatest(robot.sent, excluded.sent) else excluded.sent end
$$;

create function note(site text, robot text, what text) returns void language plpgsql as $$
begin
    insert into event values (site, robot, now(), what);
    raise warning '%/%: %', site, robot, what;
end $$;

create function parameters(body jsonb, out joints text[], out log_values double precision[], out log_stds double precision[], out verdicts text[])
immutable language sql as $$
    select (select array_agg(joint->>'name' order by place) from jsonb_array_elements(body->'joints') with ordinality as joints(joint, place)),
        array_agg(case when estimate > 0 then ln(estimate) end order by place, kind desc, axis),
        array_agg(case when estimate > 0 and verdict = 'identified' then std / estimate end order by place, kind desc, axis),
        array_agg(verdict order by place, kind desc, axis)
    from jsonb_array_elements(body->'joints') with ordinality as joints(joint, place), unnest(array['stiffness', 'damping']) as kinds(kind),
        generate_series(0, 5) as axes(axis),
        lateral (select
            (joint->kind->>axis)::double precision as estimate,
            (joint->(kind || '_std')->>axis)::double precision as std,
            joint->(kind || '_verdict')->>axis as verdict) as entries
$$;

-- Keeps a finding, and notes what somebody should look at.
create function take_finding(own_site text, own_robot text, text_ text) returns void language plpgsql as $$
declare
    body jsonb := text_::jsonb;
    own finding;
    before finding;
    older finding;
    other text;
begin
    if body->>'site' is distinct from own_site or body->>'robot_id' is distinct from own_robot then
        raise data_exception using message = format('is of %s/%s: correct the robot, or the acl_file', body->>'site', body->>'robot_id');
    end if;
    own := (own_site, own_robot, (body->>'sequence')::bigint, encode(sha256(convert_to(text_, 'UTF8')), 'hex'), body->>'box', body->>'boot_id',
        (body->>'found_at')::timestamptz, (body->>'begun')::timestamptz, (body->>'synchronised')::boolean, now(), (body->>'schema')::integer,
        body->'fit'->>'acceptance', body->>'model_sha256', body->>'config_sha256', body->>'tool', body, null, null, null, null)::finding;
    if own.schema = 2 then
        select * into own.joints, own.log_values, own.log_stds, own.verdicts from parameters(body);
    end if;
    select * into before from finding where site = own.site and robot = own.robot order by received_at desc, sequence desc limit 1;
    insert into finding select own.* on conflict do nothing;
    if not found then
        return;
    end if;
    perform take_sent(own.site, own.robot, own.box, own.sequence);
    if own.schema <> 2 then
        perform note(own.site, own.robot, format('finding %s has schema %s, this database knows 2: its parameters are not taken; install the newer flexid collect', own.sequence, own.schema));
    end if;
    if own.synchronised is false then
        perform note(own.site, own.robot, format('finding %s: the clock of the box is not synchronised: set up chrony there', own.sequence));
    end if;
    -- What was asked for again comes after newer ones.
    select * into older from finding where site = own.site and robot = own.robot and box = own.box and sequence < own.sequence
        order by sequence desc limit 1;
    if older.model_sha256 <> own.model_sha256 then
        perform note(own.site, own.robot, format('finding %s is of another model than %s', own.sequence, older.sequence));
    end if;
    select boot_id into other from finding
        where site = own.site and robot = own.robot and box = own.box and sequence = own.sequence and sha256 <> own.sha256 limit 1;
    if found then
        perform note(own.site, own.robot, format('finding %s came twice with other contents, from the boots %s and %s: two boxes have one outbox: remove the file box of one', own.sequence, other, own.boot_id));
    elsif before.box <> own.box then
        if older.sequence is not null then
            perform note(own.site, own.robot, format('the boxes %s (boot %s) and %s (boot %s) both send: give one robot another name', before.box, before.boot_id, own.box, own.boot_id));
        else
            perform note(own.site, own.robot, format('box %s follows box %s', own.box, before.box));
        end if;
    end if;
end $$;

create function take_status(own_site text, own_robot text, own jsonb) returns void language sql as $$
    select take_sent(own_site, own_robot, own->>'box', (own->>'sent')::bigint);
    update robot set online = (own->>'online')::boolean, daemon = (own->>'daemon')::boolean, tool = own->>'tool', told_at = now()
    where site = own_site and robot = own_robot
$$;

-- Messages of the broker go in here.
create view message as select now() as time, ''::text as topic, ''::text as value where false;

create function take() returns trigger language plpgsql security definer set search_path from current as $$
declare
    level text[] := string_to_array(new.topic, '/');
begin
    if new.topic !~ '^flexid/v1/[A-Za-z0-9._-]{1,64}/[A-Za-z0-9._-]{1,64}/(finding|status|health)$' then
        raise data_exception using message = 'is of no topic flexid/v1/SITE/ROBOT/finding: correct the topics of the subscription';
    elsif level[5] = 'finding' then
        perform take_finding(level[3], level[4], new.value);
    elsif level[5] = 'status' and new.value <> '' then
        perform take_status(level[3], level[4], new.value::jsonb);
    end if;
    return new;
exception when data_exception or integrity_constraint_violation or program_limit_exceeded then
    insert into refused (topic, why, payload) values (new.topic, sqlerrm, convert_to(new.value, 'UTF8')) on conflict do nothing;
    raise warning '%: %: kept in the table refused', new.topic, sqlerrm;
    return new;
end $$;

create trigger take instead of insert on message for each row execute function take();

-- What Grafana reads.
create view newest as
select own.* from robot cross join lateral (
    select * from finding where (finding.site, finding.robot) = (robot.site, robot.robot) order by found_at desc, sequence desc limit 1) as own;

-- A row for each parameter. A value that is not positive has no logarithm, and no row.
create function axis(number bigint) returns text immutable language sql
    return (array['tx', 'ty', 'tz', 'rx', 'ry', 'rz'])[(number - 1) % 6 + 1];
create function kind(number bigint) returns text immutable language sql
    return (array['stiffness', 'damping'])[(number - 1) / 6 % 2 + 1];
create view parameter as
select site, robot, sequence, sha256, found_at, joints[(number - 1) / 12 + 1] as joint, axis(number), kind(number), log_value, log_std, verdict
from finding, unnest(log_values, log_stds, verdicts) with ordinality as entries(log_value, log_std, verdict, number)
where log_value is not null;

create view history as
select found_at as time, site, robot, sequence, joint, axis, kind, exp(log_value) as value, exp(log_value - 1.96 * log_std) as low,
    exp(log_value + 1.96 * log_std) as high, verdict
from parameter;

-- Change of each parameter from the first finding of its robot at or after an instant to the newest, where both identified it: per cent, with
-- its standard deviation. Two findings of one daemon share records, so that the deviation is an upper bound.
create function change(start timestamptz)
returns table (site text, robot text, joint text, axis text, kind text, since timestamptz, percent double precision, std double precision)
stable language sql begin atomic
    select site, robot, joints[(number - 1) / 12 + 1], axis(number), kind(number), since,
        100 * (exp(new_value - old_value) - 1), 100 * sqrt(new_std * new_std + old_std * old_std)
    from (
        select robot.site, robot.robot, newest.joints, oldest.found_at as since, unnest(oldest.log_values) as old_value, unnest(oldest.log_stds) as old_std,
            unnest(newest.log_values) as new_value, unnest(newest.log_stds) as new_std, generate_series(1::bigint, cardinality(newest.log_values)) as number
        from robot
        cross join lateral (select * from finding where (finding.site, finding.robot) = (robot.site, robot.robot) and found_at >= start
            order by found_at, sequence limit 1) as oldest
        cross join lateral (select * from finding where (finding.site, finding.robot) = (robot.site, robot.robot)
            order by found_at desc, sequence desc limit 1) as newest
        where oldest.joints = newest.joints and oldest.found_at < newest.found_at) as entries
    where old_std + new_std is not null;
end;

-- Who may do what. They are asked for no password where they come by the Unix socket as users of these names.
do $$
declare
    role text;
begin
    foreach role in array array['flexid-collect', 'flexid-read'] loop
        if not exists (select from pg_roles where rolname = role) then
            execute format('create role %I login', role);
        end if;
    end loop;
end $$;
grant insert on message, refused to "flexid-collect";
grant select on gap, migration to "flexid-collect";
grant select on all tables in schema public to "flexid-read";
