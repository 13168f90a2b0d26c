#pragma once

#include <filesystem>
#include <functional>
#include <string>
#include <vector>

#include "record.h"

namespace rayrep::bench {

struct TableOptions {
  std::filesystem::path examples;           ///< folder of the project's own meshes
  std::filesystem::path meshes;             ///< folder with those of others (names as in issue 3 of the project); empty: none
  std::filesystem::path tool;               ///< the rayrep command, for whole runs
  bool quick = false;                       ///< small resolutions, for trying the harness itself
  double cap_s = 300;                       ///< of each solve
  std::function<void(const Record&)> each;  ///< told of each record as it comes
};

/// Name of the solver of records about proofs of the global optimum.
inline constexpr const char* kCertificate = "certificate";

/// The tables there are, in the order of docs/results.md.
const std::vector<std::string>& table_names();

/// Measures one table. @throws std::invalid_argument for another name
std::vector<Record> run_table(const std::string& name, const TableOptions& options);

/// What the papers print, with where: rows of Tables 1 and 2 of the ray-reps paper (Intel Xeon E5-1620, 8 GB).
struct PaperRow {
  const char* model;
  const char* resolution;
  int longest;                         ///< side of the grid, in voxels
  const char* goal;                    ///< "float" or "spin"
  std::vector<std::string> stand_ins;  ///< of the examples
  int ray_variables;
  double ray_s;
  int voxel_variables;  ///< 0: not in the table
  double voxel_s;
};
const std::vector<PaperRow>& paper_table1();
const std::vector<PaperRow>& paper_table2();

}  // namespace rayrep::bench
