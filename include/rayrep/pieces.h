#pragma once

/// What rayrep is made of, for those who build something else from it. These may change with any version.

// clang-format off
#include "rayrep/rayrep.h"

#include "rayrep/base/child_process.h"    // programs that run beside this one

#include "rayrep/mesh/block_field.h"      // sparse samples of a field
#include "rayrep/mesh/surface_query.h"    // nearest points and crossings (Embree)
#include "rayrep/mesh/level_set.h"        // field -> mesh (OpenVDB)

#include "rayrep/rays/ray_rep.h"          // solids as intervals along rays
#include "rayrep/rays/ray_cast.h"         // mesh -> ray-rep
#include "rayrep/rays/inner_domain.h"     // everything at least a wall away from the surface
#include "rayrep/rays/ray_integrals.h"    // moments of the part of the rays where a quadric is negative
#include "rayrep/rays/interior.h"         // design variables -> moments
#include "rayrep/rays/ray_interior.h"     // an interior on rays
#include "rayrep/rays/voxel_interior.h"   // an interior on uniform voxels
#include "rayrep/rays/octree_interior.h"  // an interior on an octree of cells

#include "rayrep/solve/goals.h"           // moments -> objective and constraints
#include "rayrep/solve/parts.h"           // of several bodies at once
#include "rayrep/solve/quadric.h"         // the optimum in closed form, with a proof
#include "rayrep/solve/certify.h"         // the global optimum of a spin, with proof
#include "rayrep/solve/nlp.h"             // goal and interior as a nonlinear programme
#include "rayrep/solve/solve.h"           // by Ipopt
#include "rayrep/solve/solve_octree.h"    // split and merge
#include "rayrep/solve/solve_target.h"    // targets, with weights that converge

#include "rayrep/draw/bead_bars.h"        // what a nozzle lays down -> triangles
#include "rayrep/draw/shading.h"          // triangles -> pixels

#include "rayrep/motion/scene.h"          // parts that move: states, and the ways between them
#include "rayrep/motion/urdf.h"           // robots as scenes
#include "rayrep/motion/gltf.h"           // scenes as animated glTF
#include "rayrep/motion/motion_check.h"   // when, where and how badly they get into each other
#include "rayrep/motion/resolve.h"        // what moves them out of each other's way
#include "rayrep/motion/carve.h"          // room for the way of one through another

#include "rayrep/make/waterline.h"        // which waterlines can be met
#include "rayrep/make/preview.h"          // what would be found, without a mesh
#include "rayrep/make/cavity.h"           // solution -> mesh of the cavity
#include "rayrep/report/motion_report.h"  // what was found out about a scene -> JSON, text
#include "rayrep/report/page_data.h"      // what a page shows, without the page
#include "rayrep/report/balance_report.h" // what came of balancing a thing of several parts -> JSON, text
#include "rayrep/report/scene_page.h"     // what was found out about a scene -> a page
// clang-format on
