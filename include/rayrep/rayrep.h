#pragma once

/// The rayrep library: interiors that make prints of 3D shapes float, stand, spin, weigh and turn as wanted. This is what is
/// promised: it changes with a new minor version only. What it is made of is in rayrep/pieces.h. Data flows down this list.
///
///     const MeshFile file = read_mesh("duck.stl");
///     const CheckedMesh duck = require_solid(file.mesh, "duck.stl");
///     const HollowResult result = hollow(duck.mesh, FloatSpec{});
///     write_mesh("duck_float.stl", result.delivery.body());
///     const Verdict verdict = verify(read_mesh("duck_float.stl").mesh, &duck.mesh, result.spec);

// clang-format off
#include "rayrep/base/error.h"               // what can go wrong, and exit codes
#include "rayrep/base/progress.h"            // stages and cancellation
#include "rayrep/base/setting.h"             // what can be set, with words, units and ranges
#include "rayrep/base/figure.h"              // what is found out, likewise

#include "rayrep/mesh/mesh.h"                // triangles
#include "rayrep/mesh/mesh_check.h"          // defects; the union of overlapping components
#include "rayrep/mesh/section.h"             // where a mesh crosses a plane
#include "rayrep/mesh/quadric.h"             // a quadric as a function of the point: planes, cylinders and all others
#include "rayrep/mesh/clip.h"                // what of a mesh lies above a plane, or on one side of a cylinder or another quadric
#include "rayrep/mesh/boolean.h"             // union, intersection, difference of meshes
#include "rayrep/mesh/bodies.h"              // which parts of a mesh hang together
#include "rayrep/mesh/delivery.h"            // what is made: meshes with their roles
#include "rayrep/mesh/assembly.h"            // a body in pieces, and put together

#include "rayrep/io/mesh_io.h"               // STL, OBJ, PLY, OFF, 3MF
#include "rayrep/io/printed.h"               // what leaves a printer: G-code
#include "rayrep/io/write_file.h"            // all of a file or nothing

#include "rayrep/physics/moments.h"          // mass, centre of mass, inertia: the ten moments
#include "rayrep/physics/bead.h"             // moments of what a nozzle lays down
#include "rayrep/physics/core.h"             // heavy cores, balls, and what is fixed in a body
#include "rayrep/physics/cut.h"              // into pieces that are printed by themselves; axles
#include "rayrep/physics/axle.h"             // what the axle of a yo-yo comes to
#include "rayrep/physics/drains.h"           // holes by which cavities give up what is left in them
#include "rayrep/physics/infill.h"           // what a slicer lays down where it is told to print sparsely
#include "rayrep/physics/inertial.h"         // the ten numbers of a rigid body, as URDF and MJCF
#include "rayrep/physics/hydrostatics.h"     // displacement, buoyancy, metacentre, where it comes to rest
#include "rayrep/physics/righting_arm.h"     // from which heel it rights itself
#include "rayrep/physics/spin.h"             // which axis, and at which speeds a spin is stable
#include "rayrep/physics/support_polygon.h"  // contact with the ground, tipping angles
#include "rayrep/physics/ground_rest.h"      // how a body rolls to rest on level ground
#include "rayrep/physics/resting_faces.h"    // on which faces it comes to rest, and how often
#include "rayrep/physics/materials.h"        // densities
#include "rayrep/physics/spin_axis.h"        // through which point a body spins
#include "rayrep/physics/spec.h"             // what a body is for
#include "rayrep/physics/mechanism.h"        // what a thing of several parts is for

#include "rayrep/make/hollow.h"              // the inside that meets a goal
#include "rayrep/make/balance.h"              // insides of several parts that rest in several states

#include "rayrep/shape/deform.h"             // an outside that makes a goal possible

#include "rayrep/print/slicer.h"             // a slicer, run as a program
#include "rayrep/print/place_print.h"        // where in a print the mesh is

#include "rayrep/draw/marks.h"               // what a picture shows besides the surface
#include "rayrep/draw/drawing.h"             // pictures as SVG and PNG
#include "rayrep/draw/section_picture.h"     // sections drawn to scale
#include "rayrep/draw/body_picture.h"        // a body before, deformed and after; thumbnails

#include "rayrep/judge/verify.h"             // what a mesh is found to be
#include "rayrep/judge/verify_mechanism.h"   // of several parts
#include "rayrep/judge/kept_solid.h"         // whether it is solid where it shall be

#include "rayrep/advice/suggest.h"           // what would do when a goal is out of reach

#include "rayrep/report/report.h"            // JSON and text
#include "rayrep/report/html.h"              // a page with the bodies in 3D
// clang-format on
