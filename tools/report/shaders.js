// How surfaces look: one light from over the viewer's left shoulder, and a cut.

/** A surface of one colour; where `uEdge` is more than 0, glass that is clearest where it faces the viewer. */
export const kSurface = {
  vertex: `
    varying vec3 vNormal;
    varying vec3 vView;
    varying vec3 vPlace;
    void main() {
      vPlace = position;
      vec4 place = modelViewMatrix * vec4(position, 1.0);
      vView = -place.xyz;
      vNormal = normalMatrix * normal;
      gl_Position = projectionMatrix * place;
    }`,
  fragment: `
    uniform vec3 uColor;
    uniform float uOpacity;
    uniform float uEdge;
    uniform vec4 uCut;
    varying vec3 vNormal;
    varying vec3 vView;
    varying vec3 vPlace;
    void main() {
      if (dot(uCut.xyz, vPlace) > uCut.w) discard;
      vec3 n = normalize(vNormal);
      if (!gl_FrontFacing) n = -n;
      vec3 v = normalize(vView);
      float facing = abs(dot(n, v));
      float key = max(dot(n, normalize(vec3(-0.45, 0.75, 0.6))), 0.0);
      float fill = 0.5 + 0.5 * n.y;
      float shine = pow(max(dot(reflect(-normalize(vec3(-0.45, 0.75, 0.6)), n), v), 0.0), 24.0);
      vec3 lit = uColor * (0.42 + 0.22 * fill + 0.5 * key) + 0.14 * shine;
      float alpha = mix(uOpacity, 1.0, uEdge * pow(1.0 - facing, 2.2));
      gl_FragColor = vec4(lit, alpha);
      #include <colorspace_fragment>
    }`
};

/** A flat area in the plane of the cut, hatched as sections are drawn. */
export const kCap = {
  vertex: `
    void main() {
      gl_Position = projectionMatrix * modelViewMatrix * vec4(position, 1.0);
    }`,
  fragment: `
    uniform vec3 uColor;
    uniform vec3 uHatch;
    uniform float uPitch;
    void main() {
      float across = abs(fract((gl_FragCoord.x + gl_FragCoord.y) / uPitch) - 0.5) * uPitch;
      float line = 1.0 - smoothstep(0.06 * uPitch, 0.06 * uPitch + 1.0, across);
      gl_FragColor = vec4(mix(uColor, uHatch, line), 1.0);
      #include <colorspace_fragment>
    }`
};

/** Water or ground: a disc that fades. */
export const kDisc = {
  vertex: `
    varying vec2 vAt;
    varying vec3 vPlace;
    void main() {
      vAt = uv;
      vPlace = position;
      gl_Position = projectionMatrix * modelViewMatrix * vec4(position, 1.0);
    }`,
  fragment: `
    uniform vec3 uColor;
    uniform float uOpacity;
    uniform vec4 uCut;
    varying vec2 vAt;
    varying vec3 vPlace;
    void main() {
      if (dot(uCut.xyz, vPlace) > uCut.w) discard;
      float r = 2.0 * distance(vAt, vec2(0.5));
      gl_FragColor = vec4(uColor, uOpacity * (1.0 - smoothstep(0.72, 1.0, r)));
      #include <colorspace_fragment>
    }`
};
