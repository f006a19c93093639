// Editor script, made by simulcap and written by Unity's manual: it was not run. Put the folder under
// Assets, import avatar.glb (glTFast), drag it into a scene, select it and choose
// Tools > Simulcap > Add Cloth. Every garment gets a Cloth with its stiffness, pins and maximum
// distances, the body its capsules as colliders.
using System.Collections.Generic;
using System.Linq;
using UnityEditor;
using UnityEngine;

public static class SimulcapCloth
{
    [System.Serializable] class Capsule { public string joint; public float[] local_p0, local_p1; public float radius; }
    [System.Serializable] class Garment
    {
        public string name;
        public int[] pins;
        public float[] maxDistance;
        public float stretchingStiffness, bendingStiffness, damping, friction;
    }
    [System.Serializable] class Parameters { public Capsule[] capsules; public Garment[] garments; }

    // glTFast mirrors x to get from glTF's right-handed axes to Unity's.
    static Vector3 ToUnity(float[] p) => new Vector3(-p[0], p[1], p[2]);

    [MenuItem("Tools/Simulcap/Add Cloth")]
    static void AddCloth()
    {
        var root = Selection.activeGameObject;
        var file = AssetDatabase.FindAssets("simulcap_unity t:TextAsset").FirstOrDefault();
        if (root == null || file == null)
        {
            Debug.LogError("Select the avatar in the scene, and keep simulcap_unity.json in the project.");
            return;
        }
        var text = AssetDatabase.LoadAssetAtPath<TextAsset>(AssetDatabase.GUIDToAssetPath(file)).text;
        var parameters = JsonUtility.FromJson<Parameters>(text);
        var colliders = parameters.capsules.Select(c => AddCapsule(root.transform, c)).Where(c => c != null).ToArray();
        foreach (var garment in parameters.garments)
            AddGarment(root.transform, garment, colliders);
    }

    static Transform Find(Transform node, string name) =>
        node.GetComponentsInChildren<Transform>(true).FirstOrDefault(t => t.name == name);

    static CapsuleCollider AddCapsule(Transform root, Capsule capsule)
    {
        var joint = Find(root, capsule.joint);
        if (joint == null) { Debug.LogWarning("no joint " + capsule.joint); return null; }
        Vector3 a = ToUnity(capsule.local_p0), b = ToUnity(capsule.local_p1);
        var holder = new GameObject("capsule_" + capsule.joint);
        holder.transform.SetParent(joint, false);
        holder.transform.localPosition = 0.5f * (a + b);
        if ((b - a).sqrMagnitude > 1e-12f)
            holder.transform.localRotation = Quaternion.FromToRotation(Vector3.up, b - a);
        var collider = holder.AddComponent<CapsuleCollider>();
        collider.direction = 1;
        collider.radius = capsule.radius;
        collider.height = (b - a).magnitude + 2 * capsule.radius;  // Unity counts the caps
        return collider;
    }

    static void AddGarment(Transform root, Garment garment, CapsuleCollider[] colliders)
    {
        var node = Find(root, garment.name);
        var skin = node == null ? null : node.GetComponentInChildren<SkinnedMeshRenderer>(true);
        if (skin == null) { Debug.LogWarning("no skinned mesh " + garment.name); return; }
        var cloth = skin.gameObject.AddComponent<Cloth>();
        cloth.stretchingStiffness = garment.stretchingStiffness;
        cloth.bendingStiffness = garment.bendingStiffness;
        cloth.damping = garment.damping;
        cloth.friction = garment.friction;
        cloth.capsuleColliders = colliders;
        var pins = new HashSet<int>(garment.pins);
        var coefficients = cloth.coefficients;
        for (int v = 0; v < coefficients.Length; ++v)
        {
            float most = v < garment.maxDistance.Length ? garment.maxDistance[v] : float.MaxValue;
            coefficients[v].maxDistance = pins.Contains(v) ? 0 : most;
            coefficients[v].collisionSphereDistance = 0;
        }
        cloth.coefficients = coefficients;
    }
}
