extends Spatial
# Plays the avatar's clip and simulates its clothes: every garment a SoftBody whose pins follow the
# bones, the body a set of capsules. Godot 3 drops glTF's extras, so they come from parameters.json.

const SKIN = 0.01            # [m] that capsules are wider here: distance fields have cells of 8 cm
const LAYER_DISTANCE = 0.01  # [m] from layer to layer

export(PackedScene) var avatar

var skeleton
var player
var rest = {}       # bone -> its global transform at rest
var capsules = []   # {node: KinematicBody, bone, from_bone: Transform, radius, length}
var followers = {}  # bone -> Spatial that moves with it
var garments = []   # SoftBody

func _ready():
	var parameters = read_json("res://parameters.json")
	var scene = avatar.instance()
	add_child(scene)
	skeleton = find_of_class(scene, "Skeleton")
	player = find_of_class(scene, "AnimationPlayer")
	if player != null and player.get_animation_list().size() > 0:
		player.get_animation(player.get_animation_list()[0]).loop = true
		player.playback_process_mode = AnimationPlayer.ANIMATION_PROCESS_PHYSICS
		player.play(player.get_animation_list()[0])
		player.seek(0.0, true)
	for layer in layers_of(parameters.garments):
		for capsule in parameters.body.capsules:
			add_capsule(capsule, layer)
	follow()
	var body = scene.find_node("body", true, false)
	paint(body, body.mesh.surface_get_arrays(0))
	$Camera.translation += skeleton.to_global(skeleton.get_bone_global_pose(0).origin)
	# Bullet takes the capsules' way from the origin to here for a velocity. Clothes come after it.
	for _step in range(2):
		yield(get_tree(), "physics_frame")
	for name in parameters.garments:
		add_garment(scene.find_node(name, true, false), parameters.garments[name])

func _physics_process(_delta):
	follow()

func layers_of(garments):
	var layers = []
	for name in garments:
		if not layers.has(int(garments[name].layer)):
			layers.append(int(garments[name].layer))
	return layers

# The importer writes spine1 as spine_1.
func bone_named(name):
	for bone in range(skeleton.get_bone_count()):
		if skeleton.get_bone_name(bone).replace("_", "") == name.replace("_", ""):
			return bone
	push_error("no bone " + name)
	return 0

func follow():
	for c in capsules:
		c.node.global_transform = skeleton.global_transform * skeleton.get_bone_global_pose(c.bone) * c.from_bone
	for bone in followers:
		followers[bone].global_transform = moved(bone)

# From where a point of a bone is at rest to where it is now.
func moved(bone):
	return skeleton.global_transform * skeleton.get_bone_global_pose(bone) * rest_of(bone).affine_inverse()

func rest_of(bone):
	if not rest.has(bone):
		var parent = skeleton.get_bone_parent(bone)
		var own = skeleton.get_bone_rest(bone)
		rest[bone] = own if parent < 0 else rest_of(parent) * own
	return rest[bone]

# Hulls of points instead of CapsuleShape: its radius is a collision margin, which the distance fields
# of Bullet's soft bodies leave out, so that they would see its axis alone. Soft bodies pass through
# each other here; outer layers keep a little more distance instead.
func add_capsule(capsule, layer):
	var bone = bone_named(capsule.joint)
	var a = vector(capsule.local_p0)
	var b = vector(capsule.local_p1)
	var collision = CollisionShape.new()
	collision.shape = capsule_hull(capsule.radius + SKIN + layer * LAYER_DISTANCE, (b - a).length())
	var body = KinematicBody.new()
	body.collision_layer = 1 << layer
	body.collision_mask = 0
	body.add_child(collision)
	add_child(body)
	var z = (b - a).normalized() if a.distance_to(b) > 1e-6 else Vector3(0, 0, 1)
	var x = z.cross(Vector3(0, 0, 1) if abs(z.z) < 0.9 else Vector3(1, 0, 0)).normalized()
	capsules.append({
		"node": body, "bone": bone, "from_bone": Transform(Basis(x, z.cross(x), z), (a + b) * 0.5),
		"radius": capsule.radius, "length": (b - a).length()})

# Along z, around the origin.
func capsule_hull(radius, length):
	var points = PoolVector3Array()
	for end in [-1.0, 1.0]:
		for ring in range(4):
			var latitude = ring * PI / 8.0
			for k in range(12):
				var longitude = k * PI / 6.0
				points.append(Vector3(
					radius * cos(latitude) * cos(longitude),
					radius * cos(latitude) * sin(longitude),
					end * (0.5 * length + radius * sin(latitude))))
		points.append(Vector3(0, 0, end * (0.5 * length + radius)))
	var shape = ConvexPolygonShape.new()
	shape.points = points
	return shape

func add_garment(skinned, parameters):
	var arrays = skinned.mesh.surface_get_arrays(0)
	var plain = []
	plain.resize(Mesh.ARRAY_MAX)
	plain[Mesh.ARRAY_VERTEX] = skinned_vertices(skinned, arrays)
	plain[Mesh.ARRAY_NORMAL] = arrays[Mesh.ARRAY_NORMAL]
	plain[Mesh.ARRAY_COLOR] = arrays[Mesh.ARRAY_COLOR]
	plain[Mesh.ARRAY_INDEX] = arrays[Mesh.ARRAY_INDEX]
	var mesh = ArrayMesh.new()
	mesh.add_surface_from_arrays(Mesh.PRIMITIVE_TRIANGLES, plain)
	mesh.surface_set_material(0, skinned.mesh.surface_get_material(0))
	var hints = parameters.hints.godot3
	var cloth = SoftBody.new()
	cloth.name = skinned.name + "_cloth"
	cloth.mesh = mesh
	cloth.simulation_precision = int(hints.simulation_precision)
	cloth.total_mass = hints.total_mass
	cloth.linear_stiffness = hints.linear_stiffness
	cloth.areaAngular_stiffness = hints.area_angular_stiffness
	cloth.damping_coefficient = hints.damping_coefficient
	cloth.pressure_coefficient = 0
	cloth.collision_layer = 0
	cloth.collision_mask = 1 << int(parameters.layer)
	var pins = PoolIntArray()
	for pin in pins_of(parameters):
		pins.append(int(pin))
	cloth.set("pinned_points", pins)
	for k in range(pins.size()):
		var bone = bound_bone(skinned.skin, strongest(arrays, pins[k]))
		var node = follower(bone)
		cloth.set("attachments/%d/spatial_attachment_path" % k, NodePath("../" + node.name))
		# Without its offset a pinned vertex jumps to the node's origin.
		var place = node.global_transform.xform_inv(plain[Mesh.ARRAY_VERTEX][pins[k]])
		cloth.set("attachments/%d/offset" % k, place)
	skinned.visible = false
	add_child(cloth)
	paint(cloth, arrays)
	garments.append(cloth)

# The importer reads vertex colours, but materials don't use them.
func paint(thing, arrays):
	if arrays[Mesh.ARRAY_COLOR] == null:
		return
	var material = SpatialMaterial.new()
	material.vertex_color_use_as_albedo = true
	material.roughness = 0.9
	material.params_cull_mode = SpatialMaterial.CULL_DISABLED
	thing.material_override = material

# Bullet softens contact with moved bodies to a tenth, too little to carry clothes: those without pins
# hang on their upper edge, which is where they may get away least.
func pins_of(parameters):
	if parameters.pins.size() > 0 or parameters.max_distance.size() == 0:
		return parameters.pins
	var least = parameters.max_distance[0]
	for distance in parameters.max_distance:
		least = min(least, distance)
	var edge = []
	for v in range(parameters.max_distance.size()):
		if parameters.max_distance[v] < least + 0.001:
			edge.append(v)
	return edge

# Where the garment is in the skeleton's present pose.
func skinned_vertices(skinned, arrays):
	var transforms = []
	for k in range(skinned.skin.get_bind_count()):
		transforms.append(skeleton.global_transform * skeleton.get_bone_global_pose(bound_bone(skinned.skin, k)) * skinned.skin.get_bind_pose(k))
	var posed = PoolVector3Array()
	for v in range(arrays[Mesh.ARRAY_VERTEX].size()):
		var sum = Vector3()
		for k in range(4):
			var weight = arrays[Mesh.ARRAY_WEIGHTS][v * 4 + k]
			if weight > 0.0:
				sum += weight * transforms[int(arrays[Mesh.ARRAY_BONES][v * 4 + k])].xform(arrays[Mesh.ARRAY_VERTEX][v])
		posed.append(sum)
	return posed

# Binds name their bone or count it.
func bound_bone(skin, bind):
	var bone = skin.get_bind_bone(bind)
	return bone if bone >= 0 else skeleton.find_bone(skin.get_bind_name(bind))

# The bind with the largest weight.
func strongest(arrays, vertex):
	var best = 0
	for k in range(1, 4):
		if arrays[Mesh.ARRAY_WEIGHTS][vertex * 4 + k] > arrays[Mesh.ARRAY_WEIGHTS][vertex * 4 + best]:
			best = k
	return int(arrays[Mesh.ARRAY_BONES][vertex * 4 + best])

func follower(bone):
	if not followers.has(bone):
		var node = Spatial.new()
		node.name = "bone_%d" % bone
		add_child(node)
		node.global_transform = moved(bone)
		followers[bone] = node
	return followers[bone]

func find_of_class(node, kind):
	if node.is_class(kind):
		return node
	for child in node.get_children():
		var found = find_of_class(child, kind)
		if found != null:
			return found
	return null

func vector(numbers):
	return Vector3(numbers[0], numbers[1], numbers[2])

func read_json(path):
	var file = File.new()
	if file.open(path, File.READ) != OK:
		push_error("cannot read " + path)
		return {}
	var text = file.get_as_text()
	file.close()
	return JSON.parse(text).result
