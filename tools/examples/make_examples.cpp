// Writes the meshes of examples/ and examples/scenes/: make_examples OUTPUT_FOLDER. The shapes are in example_shapes.cpp and
// scene_shapes.cpp.

#include <cstdio>
#include <exception>
#include <filesystem>

#include "example_shapes.h"
#include "rayrep/io/mesh_io.h"
#include "rayrep/physics/moments.h"
#include "scene_shapes.h"

int main(int argc, char** argv) {
  if (argc != 2) {
    std::fprintf(stderr, "usage: make_examples OUTPUT_FOLDER\n");
    return 2;
  }
  try {
    const std::filesystem::path folder = argv[1];
    std::filesystem::create_directories(folder);
    for (const rayrep::ExampleShape& shape : rayrep::example_shapes()) {
      const rayrep::Mesh mesh = rayrep::mesh_example(shape);
      const std::filesystem::path path = folder / (shape.name + ".stl");
      rayrep::write_mesh(path, mesh);
      // A row of the table in examples/README.md.
      const Eigen::Vector3d size = rayrep::bounding_box(mesh).sizes();
      std::printf("| %s.stl | %.1f x %.1f x %.1f | %zu | %.1f |\n", shape.name.c_str(), size.x(), size.y(), size.z(),
                  mesh.triangles.size(), rayrep::mesh_moments(mesh)[rayrep::M1] / 1000);
    }
    std::filesystem::create_directories(folder / "scenes");
    for (const rayrep::SceneShape& shape : rayrep::scene_shapes())
      rayrep::write_mesh(folder / "scenes" / (shape.name + ".stl"), shape.mesh);
  } catch (const std::exception& error) {
    std::fprintf(stderr, "make_examples: %s\n", error.what());
    return 1;
  }
  return 0;
}
