#pragma once

/// The rayrep library: mass properties of 3D shapes, and interiors that make their prints float. Data flows down this list.
///
///     const MeshFile file = read_mesh("duck.stl");
///     const CheckedMesh duck = require_solid(file.mesh, "duck.stl");
///     const FloatResult result = hollow_float(duck.mesh, {});
///     write_mesh("duck_float.stl", result.hollow.delivered);
///     const FloatVerdict verdict =
///         verify_float(read_mesh("duck_float.stl").mesh, &duck.mesh, {.waterline_mm = result.waterline_mm});

#include "rayrep/block_field.h"      // sparse samples of a field
#include "rayrep/cavity.h"           // solution -> mesh of the cavity
#include "rayrep/certify.h"          // the global optimum of a spin, with proof
#include "rayrep/error.h"            // what can go wrong, and exit codes
#include "rayrep/goals.h"            // moments -> objective and constraints
#include "rayrep/hollow.h"           // all of it
#include "rayrep/hydrostatics.h"     // displacement, buoyancy, metacentre, where it comes to rest
#include "rayrep/inertial.h"         // the ten numbers of a rigid body, as URDF and MJCF
#include "rayrep/inner_domain.h"     // everything at least a wall away from the surface
#include "rayrep/interior.h"         // design variables -> moments
#include "rayrep/level_set.h"        // field -> mesh (OpenVDB)
#include "rayrep/materials.h"        // densities
#include "rayrep/mesh.h"             // triangles
#include "rayrep/mesh_check.h"       // defects; the union of overlapping components
#include "rayrep/mesh_io.h"          // STL, OBJ, PLY, OFF, 3MF
#include "rayrep/moments.h"          // mass, centre of mass, inertia: the ten moments
#include "rayrep/nlp.h"              // goal and interior as a nonlinear programme
#include "rayrep/octree_interior.h"  // an interior on an octree of cells
#include "rayrep/progress.h"         // stages and cancellation
#include "rayrep/quadric.h"          // the optimum in closed form, with a proof
#include "rayrep/ray_cast.h"         // mesh -> ray-rep
#include "rayrep/ray_integrals.h"    // moments of the part of the rays where a quadric is negative
#include "rayrep/ray_interior.h"     // an interior on rays
#include "rayrep/ray_rep.h"          // solids as intervals along rays
#include "rayrep/report.h"           // JSON
#include "rayrep/solve.h"            // by Ipopt
#include "rayrep/solve_octree.h"     // split and merge
#include "rayrep/spin.h"             // which axis, and at which speeds a spin is stable
#include "rayrep/support_polygon.h"  // contact with the ground, tipping angles
#include "rayrep/surface_query.h"    // nearest points and crossings (Embree)
#include "rayrep/verify.h"           // the judge
#include "rayrep/voxel_interior.h"   // an interior on uniform voxels
#include "rayrep/waterline.h"        // which waterlines can be met
