export { WebGLRenderer, Scene, PerspectiveCamera, HemisphereLight, DirectionalLight, Box3, Vector3, Color, MeshStandardMaterial, DoubleSide, AxesHelper, ArrowHelper, Group, SRGBColorSpace } from 'three';
export { OrbitControls } from 'three/examples/jsm/controls/OrbitControls.js';
export { GLTFLoader } from 'three/examples/jsm/loaders/GLTFLoader.js';
export { toCreasedNormals } from 'three/examples/jsm/utils/BufferGeometryUtils.js';
