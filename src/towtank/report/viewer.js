(function () {
  "use strict";
  var box = document.getElementById("view"), data = document.getElementById("craft-glb");
  if (!box || !data || typeof TowtankThree === "undefined") return;
  if (!document.createElement("canvas").getContext("webgl2")) return; // no WebGL: the still picture stays
  var T = TowtankThree, renderer;
  try {
    renderer = new T.WebGLRenderer({ antialias: true, alpha: true });
  } catch (error) {
    return;
  }
  var text = atob(data.textContent.trim()), bytes = new Uint8Array(text.length);
  for (var i = 0; i < text.length; i++) bytes[i] = text.charCodeAt(i);
  new T.GLTFLoader().parse(bytes.buffer, "", show, function () {});

  function show(gltf) {
    var scene = new T.Scene(), craft = new T.Group();
    var paint = new T.MeshStandardMaterial({ color: 0xc3d3dd, roughness: 0.55, metalness: 0.1, side: T.DoubleSide });
    gltf.scene.traverse(function (node) {
      if (!node.isMesh) return;
      node.geometry = T.toCreasedNormals(node.geometry, 0.6);
      node.material = paint;
    });
    craft.add(gltf.scene);
    var bounds = new T.Box3().setFromObject(craft), size = bounds.getSize(new T.Vector3()), middle = bounds.getCenter(new T.Vector3());
    craft.position.sub(middle);
    scene.add(craft);
    scene.add(new T.HemisphereLight(0xffffff, 0x8c9aa5, 1.6));
    var sun = new T.DirectionalLight(0xffffff, 1.6);
    scene.add(sun);
    var camera = new T.PerspectiveCamera(28, 16 / 7, size.length() * 0.01, size.length() * 20);
    // glTF axes: y up, z forward, x to port. The eye is above the starboard bow.
    camera.position.set(-0.62, 0.4, 0.62).normalize().multiplyScalar(size.length() * 1.2);
    var controls = new T.OrbitControls(camera, renderer.domElement);
    controls.enableZoom = true;
    function draw() {
      sun.position.copy(camera.position).addScaledVector(camera.up, size.length() * 0.8);
      renderer.render(scene, camera);
    }
    function fit() {
      var width = box.clientWidth, height = box.clientHeight;
      if (!width || !height) return;
      renderer.setPixelRatio(Math.min(window.devicePixelRatio || 1, 2));
      renderer.setSize(width, height, false);
      camera.aspect = width / height;
      camera.updateProjectionMatrix();
      draw();
    }
    box.appendChild(renderer.domElement);
    box.dataset.state = "live";
    document.getElementById("view-hint").textContent = "Drag to turn, scroll to zoom, right-drag to move.";
    controls.addEventListener("change", draw);
    window.addEventListener("resize", fit);
    fit();
  }
})();
