function port = new_model(model, gravity)
% NEW_MODEL  Makes a model with a world and its gravity (m/s^2), and returns the port of the world's frame.
load_system('sm_lib');
load_system('nesl_utility');
new_system(model);
% The bushings are stiff.
set_param(model, 'SolverType', 'Variable-step', 'Solver', 'ode23t', 'MaxStep', '1e-3', 'RelTol', '1e-6', 'AbsTol', '1e-9');
world = ports(add_block('sm_lib/Frames and Transforms/World Frame', [model '/World']));
mechanism = add_block('sm_lib/Utilities/Mechanism Configuration', [model '/Mechanism']);
set_param(mechanism, 'GravityVector', mat2str(gravity, 17));
solver = ports(add_block('nesl_utility/Solver Configuration', [model '/Solver']));
mechanism = ports(mechanism);
port = world.RConn(1);
add_line(model, port, mechanism.RConn(1), 'autorouting', 'on');
add_line(model, port, solver.RConn(1), 'autorouting', 'on');
end

function port = add_joint(model, port, joint)
% ADD_JOINT  Adds a locked drive, its bushing and its link behind a port, and returns the port of the link's frame.
port = add_transform(model, port, [joint.name ' drive'], joint);
bushing = add_block('sm_lib/Joints/Bushing Joint', path_of(model, [joint.name ' bushing']));
primitives = {'Px', 'Py', 'Pz', 'Rx', 'Ry', 'Rz'};
for dof = 1:6
    if dof <= 3
        units = {'N/m', 'N/(m/s)', 'm'};
    else
        units = {'N*m/rad', 'N*m/(rad/s)', 'rad'};
    end
    primitive = primitives{dof};
    set_param(bushing, ...
        [primitive 'EquilibriumPosition'], '0', [primitive 'EquilibriumPositionUnits'], units{3}, ...
        [primitive 'SpringStiffness'], num2str(joint.stiffness(dof), 17), [primitive 'SpringStiffnessUnits'], units{1}, ...
        [primitive 'DampingCoefficient'], num2str(joint.damping(dof), 17), [primitive 'DampingCoefficientUnits'], units{2});
    % It starts at rest under gravity, where that place is known.
    if ~isempty(joint.rest)
        set_param(bushing, [primitive 'PositionTargetSpecify'], 'on', [primitive 'PositionTargetPriority'], 'High', ...
            [primitive 'PositionTargetValue'], num2str(joint.rest(dof), 17), [primitive 'PositionTargetValueUnits'], units{3});
    end
end
bushing = ports(bushing);
add_line(model, port, bushing.LConn(1), 'autorouting', 'on');
port = bushing.RConn(1);
link = add_block('sm_lib/Body Elements/Inertia', path_of(model, [joint.name ' link']));
set_param(link, 'InertiaType', 'Custom', 'Mass', num2str(joint.mass, 17), 'MassUnits', 'kg', ...
    'CenterOfMass', mat2str(joint.centre_of_mass, 17), 'CenterOfMassUnits', 'm', ...
    'MomentsOfInertia', mat2str(joint.moments, 17), 'MomentsOfInertiaUnits', 'kg*m^2', ...
    'ProductsOfInertia', mat2str(joint.products, 17), 'ProductsOfInertiaUnits', 'kg*m^2');
link = ports(link);
connections = [link.LConn link.RConn];
add_line(model, port, connections(1), 'autorouting', 'on');
end

function add_tcp(model, port, tcp)
% ADD_TCP  Adds the frame of the tool centre point. Forces and sensors connect to it.
port = add_transform(model, port, 'TCP', tcp);
frame = ports(add_block('sm_lib/Frames and Transforms/Reference Frame', [model '/TCP frame']));
connections = [frame.LConn frame.RConn];
add_line(model, port, connections(1), 'autorouting', 'on');
end

function port = add_transform(model, port, name, pose)
% ADD_TRANSFORM  Adds a fixed pose behind a port, and returns the port of the frame there.
block = add_block('sm_lib/Frames and Transforms/Rigid Transform', path_of(model, name));
set_param(block, 'RotationMethod', 'RotationMatrix', 'RotationMatrix', mat2str(pose.rotation, 17), ...
    'TranslationMethod', 'Cartesian', 'TranslationCartesianOffset', mat2str(pose.translation, 17), ...
    'TranslationCartesianOffsetUnits', 'm');
block = ports(block);
add_line(model, port, block.LConn(1), 'autorouting', 'on');
port = block.RConn(1);
end

function path = path_of(model, name)
% PATH_OF  Returns the path of a block. A slash in its name is doubled.
path = [model '/' strrep(name, '/', '//')];
end

function handles = ports(block)
% PORTS  Returns the handles of the ports of a block.
handles = get_param(block, 'PortHandles');
end
