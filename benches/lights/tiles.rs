//! A room under a ceiling of ten panels of light, each whole or in a thousand tiles of the same radiance: the
//! picture is the same, so what differs is what the number of lights costs.

use std::fmt::Write;

/// Panels along x and z, and half the side of each, m.
const PANELS: [u32; 2] = [5, 2];
const HALF: [f32; 2] = [0.3, 0.4];
/// Pieces of a panel along x and z where it is in tiles.
const PIECES: [u32; 2] = [40, 25];

/// Ten lights.
pub fn panels() -> String {
    room([1, 1])
}

/// Ten thousand.
pub fn tiles() -> String {
    room(PIECES)
}

fn room(pieces: [u32; 2]) -> String {
    let mut xml = String::from(HEAD);
    for k in 0..PANELS[0] * PANELS[1] {
        let panel = [k % PANELS[0], k / PANELS[0]];
        for i in 0..pieces[0] * pieces[1] {
            let piece = [i % pieces[0], i / pieces[0]];
            // Panels are a half of their side apart.
            let at = [0, 1].map(|d| {
                let middle = (panel[d] as f32 - 0.5 * (PANELS[d] - 1) as f32) * 2.5 * HALF[d];
                middle + ((2 * piece[d] + 1) as f32 / pieces[d] as f32 - 1.0) * HALF[d]
            });
            let size = [HALF[0] / pieces[0] as f32, HALF[1] / pieces[1] as f32];
            let _ = writeln!(
                xml,
                r#"<shape type="rectangle"><transform name="to_world"><scale x="{}" y="{}"/><rotate x="1" angle="90"/><translate x="{}" y="2.4" z="{}"/></transform><ref id="black"/><emitter type="area"><rgb name="radiance" value="6, 5.5, 5"/></emitter></shape>"#,
                size[0], size[1], at[0], at[1]
            );
        }
    }
    xml + "</scene>"
}

const HEAD: &str = r#"<scene version="3.0.0">
<sensor type="perspective"><float name="fov" value="60"/>
  <transform name="to_world"><lookat origin="0.4, 1.3, 2.9" target="0, 0.9, 0" up="0, 1, 0"/></transform>
  <film type="hdrfilm"><integer name="width" value="64"/><integer name="height" value="48"/><rfilter type="box"/></film></sensor>
<bsdf type="twosided" id="white"><bsdf type="diffuse"><rgb name="reflectance" value="0.7, 0.68, 0.62"/></bsdf></bsdf>
<bsdf type="twosided" id="red"><bsdf type="diffuse"><rgb name="reflectance" value="0.6, 0.2, 0.15"/></bsdf></bsdf>
<bsdf type="diffuse" id="black"><rgb name="reflectance" value="0"/></bsdf>
<shape type="rectangle"><transform name="to_world"><scale x="2.2" y="3"/><rotate x="1" angle="-90"/></transform><ref id="white"/></shape>
<shape type="rectangle"><transform name="to_world"><scale x="2.2" y="3"/><rotate x="1" angle="90"/><translate y="2.5"/></transform><ref id="white"/></shape>
<shape type="rectangle"><transform name="to_world"><scale x="2.2" y="1.25"/><translate y="1.25" z="-3"/></transform><ref id="white"/></shape>
<shape type="rectangle"><transform name="to_world"><scale x="2.2" y="1.25"/><rotate y="1" angle="180"/><translate y="1.25" z="3"/></transform><ref id="white"/></shape>
<shape type="rectangle"><transform name="to_world"><scale x="3" y="1.25"/><rotate y="1" angle="90"/><translate x="-2.2" y="1.25"/></transform><ref id="red"/></shape>
<shape type="rectangle"><transform name="to_world"><scale x="3" y="1.25"/><rotate y="1" angle="-90"/><translate x="2.2" y="1.25"/></transform><ref id="white"/></shape>
<shape type="cube"><transform name="to_world"><scale x="0.5" y="0.4" z="0.4"/><rotate y="1" angle="25"/><translate x="-0.7" y="0.4" z="-0.6"/></transform><ref id="white"/></shape>
<shape type="sphere"><point name="center" value="0.7, 0.5, 0.1"/><float name="radius" value="0.5"/><ref id="red"/></shape>
<shape type="cube"><transform name="to_world"><scale x="0.9" y="0.03" z="0.5"/><translate x="1.2" y="1.5" z="-1.5"/></transform><ref id="white"/></shape>
"#;
