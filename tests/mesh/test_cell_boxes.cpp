#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <random>
#include <vector>

#include "mesh/cell_boxes.h"
#include "solids.h"

namespace rayrep {
namespace {

using Eigen::Vector3d;
using namespace test;

bool meet(const CellBox& a, const CellBox& b) {
  for (std::size_t k = 0; k < 3; ++k)
    if (a.low[k] > b.high[k] || b.low[k] > a.high[k]) return false;
  return true;
}

std::vector<int> sorted(std::vector<int> numbers) {
  std::sort(numbers.begin(), numbers.end());
  return numbers;
}

TEST(CellBoxes, OfEightsTheTreeFindsThoseThatMeetABox) {
  std::mt19937 engine(3);
  std::uniform_real_distribution<double> at(-14, 14), size(0, 6);
  for (const Mesh& mesh : {icosphere(10, 4), torus(8, 3, 31, 17), box({-9, -1, 0}, {9, 1, 3})}) {
    const CellGrid grid(mesh);
    const BoxesInEights tree(grid, mesh);
    const std::vector<CellBox> boxes = grid.boxes_of_triangles(mesh);
    std::size_t met = 0;
    for (int n = 0; n < 300; ++n) {
      const Vector3d low(at(engine), at(engine), at(engine));
      const CellBox wanted = grid.around({low, low + Vector3d(size(engine), size(engine), size(engine))});
      std::vector<int> all, found;
      for (std::size_t t = 0; t < boxes.size(); ++t)
        if (meet(boxes[t], wanted)) all.push_back(static_cast<int>(t));
      tree.meeting(wanted, found);
      EXPECT_EQ(sorted(found), all);
      met += all.size();
    }
    EXPECT_GT(met, 0u);
  }
}

TEST(CellBoxes, AreAroundWhatIsInThem) {
  const Mesh mesh = icosphere(10, 3);
  const CellGrid grid(mesh);
  const std::vector<CellBox> boxes = grid.boxes_of_triangles(mesh);
  for (std::size_t t = 0; t < boxes.size(); ++t)
    for (int k = 0; k < 3; ++k) EXPECT_TRUE(meet(boxes[t], grid.around({mesh.corner(t, k), mesh.corner(t, k)})));
}

TEST(CellBoxes, BeyondAllNumbersAreFoundAndOthersAreNot) {
  const Mesh mesh = icosphere(10, 2);
  const CellGrid grid(mesh);
  const BoxesInEights tree(grid, mesh);
  std::vector<int> found;
  tree.meeting(grid.around({Vector3d::Constant(-1e9), Vector3d::Constant(1e9)}), found);
  EXPECT_EQ(found.size(), mesh.triangles.size());
  tree.meeting(grid.around({Vector3d::Constant(1e8), Vector3d::Constant(1e9)}), found);
  EXPECT_TRUE(found.empty());
  BoxesInEights(CellGrid(Mesh()), Mesh()).meeting(grid.around(bounding_box(mesh)), found);
  EXPECT_TRUE(found.empty());
}

}  // namespace
}  // namespace rayrep
