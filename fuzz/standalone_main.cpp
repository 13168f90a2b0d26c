// Runs fuzz/fuzz_read_mesh.cpp without libFuzzer, so that it compiles with any compiler and runs as a test: over the files
// named on the command line, and over seeded random changes of built-in meshes. The same arguments do the same work.
//
//   fuzz_read_mesh [--mutations N (20000)] [--write-seeds FOLDER] [FILE...]
//
// --write-seeds saves the built-in meshes as a first corpus for libFuzzer.

#include <algorithm>
#include <array>
#include <cstdint>
#include <cstdlib>
#include <exception>
#include <fstream>
#include <iostream>
#include <iterator>
#include <random>
#include <string>
#include <string_view>
#include <vector>

#include "io/mesh_io_detail.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size);  // NOLINT(readability-identifier-naming)

namespace {

using Random = std::mt19937_64;

/// The file kinds by the first byte of an input, as in fuzz_read_mesh.cpp.
enum Kind : char { kStl, kObj, kPly, kOff, k3mf, kModel };

std::string input(Kind kind, const std::string& bytes) { return static_cast<char>(kind) + bytes; }

/// The object of a tetrahedron that is moved along x.
std::string tetrahedron_xml(const std::string& id, double x) {
  std::string text = "<object id=\"" + id + "\"><mesh><vertices>";
  for (const char* rest : {"0\" y=\"0\" z=\"0\"/>", "1\" y=\"0\" z=\"0\"/>", "0\" y=\"1\" z=\"0\"/>", "0\" y=\"0\" z=\"1\"/>"})
    text += "<vertex x=\"" + std::to_string(x + (rest[0] - '0')) + std::string(rest).substr(1);
  return text +
         "</vertices><triangles><triangle v1=\"0\" v2=\"2\" v3=\"1\"/><triangle v1=\"0\" v2=\"1\" v3=\"3\"/><triangle v1=\"0\" "
         "v2=\"3\" v3=\"2\"/><triangle v1=\"1\" v2=\"2\" v3=\"3\"/></triangles></mesh></object>";
}

std::vector<std::string> seeds() {
  rayrep::Mesh mesh;
  mesh.vertices = {{0, 0, 0}, {1.5, 0, 0}, {0, 2.25, 0}, {0, 0, 1e-3}};
  mesh.triangles = {{0, 2, 1}, {0, 1, 3}, {1, 2, 3}, {2, 0, 3}};
  std::string big_endian =
      "ply\nformat binary_big_endian 1.0\nelement vertex 3\nproperty uchar x\nproperty short y\nproperty char z\n"
      "element face 1\nproperty list uchar ushort vertex_index\nend_header\n";
  big_endian += std::string("\1\0\1\0\0\0\2\0\1\0\0\0\3\0\0\0\1\0\2", 19);
  return {
      input(kStl, rayrep::detail::encode_mesh("a.stl", mesh)),
      input(kStl,
            "solid a b\n facet normal 0 0 1\n  outer loop\n   vertex 0 0 0\n   vertex 1e0 0 nan\n   vertex 0 1 0\n  endloop\n "
            "endfacet\n"
            "endsolid a b\n"),
      input(kObj, rayrep::detail::encode_mesh("a.obj", mesh)),
      input(kObj, "v 0 0 0\nv 4 0 0 1 0 0\nv 4 4 0\nv 2 1 0\nv 0 4 0\nvt 0 0\ng a\nf 1/1 2/1 3/1 4/1 5/1\nf -1 -2 \\\n-3\n# end\n"),
      input(kPly, rayrep::detail::encode_mesh("a.ply", mesh)),
      input(kPly, big_endian),
      input(
          kPly,
          "ply\nformat ascii 1.0\nelement vertex 4\nproperty double x\nproperty float y\nproperty list uchar int q\nproperty int "
          "z\n"
          "element face 2\nproperty uchar c\nproperty list uchar int vertex_indices\nend_header\n0 0 1 5 0\n1 0 0 0\n0 1 2 7 7 0\n"
          "1 1 0 0\n9 3 0 1 2\n9 4 0 1 2 3\n"),
      input(kPly,
            "ply\nformat ascii 1.0\nelement vertex 4\nproperty float x\nproperty float y\nproperty float z\n"
            "element tristrips 1\nproperty list int int vertex_indices\nend_header\n0 0 0\n1 0 0\n0 1 0\n0 0 1\n"
            "10 0 2 1 3 0 2 -1 1 2 3\n"),
      input(kOff, "OFF # box\n5 2 0\n0 0 0\n1 0 0\n1 1 0 255 0 0\n\n0 1 0\n0.5 0.1 0\n5 0 4 1 2 3 1 0 0\n3 0 1 2\n"),
      input(k3mf, rayrep::detail::encode_mesh("a.3mf", mesh)),
      input(
          kModel,
          "<model unit=\"inch\" xmlns:p=\"http://schemas.microsoft.com/3dmanufacturing/production/2015/06\" "
          "requiredextensions=\"p\">"
          "<resources><object id=\"1\"><mesh><vertices><vertex x=\"0\" y=\"0\" z=\"0\"/><vertex x=\"1\" y=\"0\" z=\"0\"/><vertex "
          "x=\"0\" "
          "y=\"1\" z=\"0\"/></vertices><triangles><triangle v1=\"0\" v2=\"1\" v3=\"2\"/></triangles></mesh></object><object "
          "id=\"2\" "
          "type=\"model\"><components><component objectid=\"1\" transform=\"-1 0 0 0 1 0 0 0 1 0 0 0\"/><component objectid=\"1\"/>"
          "</components></object></resources><build><item objectid=\"2\" transform=\"1 0 0 0 2 0 0 0 1 5 0 0\" "
          "printable=\"1\"/><item "
          "objectid=\"1\" p:path=\"/3D/3dmodel.model\"/></build></model>"),
      input(kModel,
            "<model><resources>" + tetrahedron_xml("1", 0) + tetrahedron_xml("2", 0.25) +
                "<object id=\"3\"><components><component objectid=\"1\"/><component "
                "objectid=\"2\"/></components></object></resources>"
                "<build><item objectid=\"3\"/></build></model><config><object id=\"3\"><part id=\"2\" subtype=\"negative_part\"/>"
                "</object><object id=\"1\"><volume firstid=\"9\" lastid=\"9\"/></object></config>"),
  };
}

std::size_t below(Random& random, std::size_t limit) { return static_cast<std::size_t>(random() % limit); }

/// One random change of everything but the first byte.
void mutate(std::string& bytes, Random& random) {
  constexpr std::array<std::string_view, 20> kWords = {
      "0",   "-1", "1",  "2147483647", "2147483648", "4294967295", "99999999999999999999", "-",  "1e", "1e999",
      "nan", "\n", "\r", " ",          "\\",         "end",        "\xff\xff\xff\xff",     "\"", "<",  ">"};
  const std::size_t at = 1 + below(random, bytes.size());
  const std::size_t length = std::min(bytes.size() - at, 1 + below(random, 16));
  switch (below(random, 7)) {
    case 0:
      if (at < bytes.size()) bytes[at] = static_cast<char>(random());
      break;
    case 1:
      if (at < bytes.size()) bytes[at] = static_cast<char>(bytes[at] ^ (1 << below(random, 8)));
      break;
    case 2:
      bytes.erase(at, length);
      break;
    case 3:
      bytes.insert(at, bytes.substr(1 + below(random, bytes.size()), 1 + below(random, 64)));
      break;
    case 4:
      bytes.replace(at, length, kWords[below(random, kWords.size())]);
      break;
    case 5:
      bytes.insert(at, kWords[below(random, kWords.size())]);
      break;
    default:
      if (below(random, 8) == 0) bytes.resize(at);
  }
}

/// False, with the input left in a file, if the target throws.
bool run(const std::string& bytes, const std::string& name) {
  try {
    LLVMFuzzerTestOneInput(reinterpret_cast<const std::uint8_t*>(bytes.data()), bytes.size());
    return true;
  } catch (const std::exception& violation) {
    std::ofstream("fuzz_read_mesh.failed", std::ios::binary) << bytes;
    std::cerr << name << ": " << violation.what() << "; the input is in fuzz_read_mesh.failed\n";
    return false;
  }
}

}  // namespace

int main(int argc, char** argv) {
  std::uint64_t mutations = 20000;
  const std::vector<std::string> built_in = seeds();
  for (int i = 1; i < argc; ++i) {
    const std::string argument = argv[i];
    if (argument == "--mutations" && i + 1 < argc) {
      mutations = std::strtoull(argv[++i], nullptr, 10);
      continue;
    }
    if (argument == "--write-seeds" && i + 1 < argc) {
      const std::string folder = argv[++i];
      for (std::size_t k = 0; k < built_in.size(); ++k)
        std::ofstream(folder + "/seed" + std::to_string(k), std::ios::binary) << built_in[k];
      continue;
    }
    std::ifstream file(argument, std::ios::binary);
    if (!file) {
      std::cerr << "cannot open " << argument << "\n";
      return 2;
    }
    if (!run(std::string(std::istreambuf_iterator<char>(file), {}), argument)) return 1;
  }
  for (const auto& seed : built_in)
    if (!run(seed, "seed")) return 1;
  for (std::uint64_t i = 0; i < mutations; ++i) {
    // A crash that ends the process is found again from the last line printed.
    if (i % 10000 == 0) std::cout << "mutation " << i << " of " << mutations << std::endl;
    Random random(i);
    std::string bytes = built_in[i % built_in.size()];
    for (std::size_t changes = 1 + below(random, 6); changes > 0; --changes) mutate(bytes, random);
    if (!run(bytes, "mutation " + std::to_string(i))) return 1;
  }
  return 0;
}
