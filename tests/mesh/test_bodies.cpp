#include <gtest/gtest.h>

#include <filesystem>

#include "places.h"
#include "rayrep/io/mesh_io.h"
#include "rayrep/mesh/bodies.h"
#include "rayrep/mesh/mesh_check.h"
#include "solids.h"

namespace rayrep {
namespace {

using test::box;
using test::merged;

int bodies(const Mesh& mesh) { return bodies_of(with_merged_vertices(mesh)).count; }

TEST(Bodies, WhatCrossesTouchesOrNestsIsOne) {
  const Mesh a = box({0, 0, 0}, {10, 10, 10});
  EXPECT_EQ(bodies(a), 1);
  EXPECT_EQ(bodies(merged({a, box({5, 5, 5}, {15, 15, 15})})), 1) << "crosses";
  EXPECT_EQ(bodies(merged({a, box({10, 2, 2}, {15, 8, 8})})), 1) << "touches in a face";
  EXPECT_EQ(bodies(merged({a, box({2, 2, 2}, {8, 8, 8})})), 1) << "lies inside";
  EXPECT_EQ(bodies(merged({a, test::flipped(box({2, 2, 2}, {8, 8, 8}))})), 1) << "is a cavity";
  EXPECT_EQ(bodies(merged({a, box({10.001, 0, 0}, {20, 10, 10})})), 2) << "is 1 micrometre away";
  // Three in a row, of which the middle one joins the others.
  const Mesh ends = merged({a, box({20, 0, 0}, {30, 10, 10})});
  EXPECT_EQ(bodies(ends), 2);
  EXPECT_EQ(bodies(merged({ends, box({9, 4, 4}, {21, 6, 6})})), 1);
}

TEST(Bodies, ACrossingElsewhereDoesNotHideThem) {
  const std::filesystem::path cases = test::shared_meshes() / "../cases";
  if (!std::filesystem::exists(cases)) GTEST_SKIP() << "no " << cases;
  for (const char* name : {"three_towers.stl", "three_towers_one_knob.stl"})
    EXPECT_EQ(bodies_of(check_mesh(read_mesh(cases / name).mesh).mesh).count, 3) << name;
}

}  // namespace
}  // namespace rayrep
