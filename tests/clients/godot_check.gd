extends SceneTree
# Runs the exported project for a second and looks at its clothes: every vertex finite, moved by
# gravity, still about as far from its neighbours as at rest, and outside the body.

const FRAMES = 60
const MOST_STRAIN = 0.25  # of an edge, 95th percentile: Godot's solver stretches cloth on its pins
const MOST_INSIDE = 0.01  # share of vertices more than DEEP within a capsule of the body
const DEEP = 0.01         # [m] of the 8 cm cells in which Bullet's soft bodies see the body

var frame = 0
var main
var start = {}  # garment -> positions when it came into the world

func _init():
	main = load("res://main.tscn").instance()
	get_root().add_child(main)

func _iteration(_delta):
	frame += 1
	for cloth in main.garments:
		if not start.has(cloth):
			start[cloth] = vertices(cloth)
	if frame < FRAMES:
		return false
	var passed = main.garments.size() > 0
	for cloth in main.garments:
		passed = looks_right(cloth) and passed
	print("PASSED" if passed else "FAILED")
	quit()
	return true

func vertices(cloth):
	cloth._draw_soft_mesh()
	return cloth.mesh.surface_get_arrays(0)[Mesh.ARRAY_VERTEX]

func looks_right(cloth):
	var now = vertices(cloth)
	var moved = 0.0
	var inside = 0
	for v in range(now.size()):
		moved = max(moved, (now[v] - start[cloth][v]).length())
		if not (now[v].length() < 10.0):
			moved = INF
		if depth(now[v]) > DEEP:
			inside += 1
	var strain = strain_of(cloth.mesh.surface_get_arrays(0)[Mesh.ARRAY_INDEX], start[cloth], now)
	print("CLOTH %s moved %.3f m, edge strain %.3f, %d of %d vertices inside the body" % [
		cloth.name, moved, strain, inside, now.size()])
	return moved > 0.001 and moved < 1.0 and strain < MOST_STRAIN and inside <= MOST_INSIDE * now.size()

# How far within the body's capsules [m].
func depth(point):
	var deepest = -INF
	for c in main.capsules:
		var local = c.node.global_transform.xform_inv(point)
		local.z -= clamp(local.z, -0.5 * c.length, 0.5 * c.length)
		deepest = max(deepest, c.radius - local.length())
	return deepest

func strain_of(indices, before, now):
	var strains = []
	for i in range(indices.size()):
		var a = indices[i]
		var b = indices[i + 1 if i % 3 < 2 else i - 2]
		var rest = before[a].distance_to(before[b])
		strains.append(abs(now[a].distance_to(now[b]) / max(rest, 1e-6) - 1.0))
	strains.sort()
	return strains[int(0.95 * strains.size())]
