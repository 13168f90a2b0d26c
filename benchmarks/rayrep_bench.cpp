// rayrep_bench: the tables and plots of docs/results.md. benchmarks/run.sh runs it all.

#include <boost/program_options.hpp>
#include <cstdio>
#include <exception>
#include <fstream>
#include <iostream>

#include "micro.h"
#include "record.h"
#include "results.h"
#include "tables.h"

namespace {

namespace po = boost::program_options;
using namespace rayrep::bench;

constexpr const char* kUsage =
    R"(rayrep_bench tables NAME... -o FILE [options]    measure (all tables when none is named)
rayrep_bench results FILE... -o FOLDER           write FOLDER/results.md and FOLDER/results/*.svg
rayrep_bench compare BEFORE AFTER                what became slower or worse; exit code 1 if anything did
rayrep_bench micro [options of Google Benchmark] parts: casting, inner domain, one evaluation, meshing, verify

Options of tables:
  --examples FOLDER   the project's own meshes (default: of the source tree)
  --meshes FOLDER     more shapes
  --quick             small resolutions, to try the harness
  --cap SECONDS       longest solve (default 300)
  --commit TEXT       noted in the file
Tables:)";

int tables(const std::vector<std::string>& arguments) {
  po::options_description known;
  po::positional_options_description positional;
  positional.add("name", -1);
  // clang-format off
  known.add_options()
    ("name", po::value<std::vector<std::string>>()->default_value(table_names(), ""))
    ("output,o", po::value<std::string>()->required())
    ("examples", po::value<std::string>()->default_value(RAYREP_EXAMPLES))
    ("meshes", po::value<std::string>()->default_value(""))
    ("quick", po::bool_switch())
    ("cap", po::value<double>()->default_value(300))
    ("commit", po::value<std::string>()->default_value("unknown"));
  // clang-format on
  po::variables_map given;
  po::store(po::command_line_parser(arguments).options(known).positional(positional).run(), given);
  po::notify(given);

  TableOptions options;
  options.examples = given["examples"].as<std::string>();
  options.meshes = given["meshes"].as<std::string>();
  options.tool = RAYREP_TOOL;
  options.quick = given["quick"].as<bool>();
  options.cap_s = given["cap"].as<double>();
  Measurements run = describe_machine(given["commit"].as<std::string>());
  run.quick = options.quick;
  run.cap_s = options.cap_s;
  const std::string output = given["output"].as<std::string>();
  options.each = [&](const Record& r) {
    std::cerr << r.table << ": " << r.mesh << ", " << r.goal << ", N " << r.resolution << ", " << r.solver << ": " << r.status
              << " " << significant(r.seconds.median, 3) << " s, objective " << significant(r.objective, 7) << std::endl;
    // Kept after each measurement: a long run that is stopped has not been for nothing.
    run.records.push_back(r);
    std::ofstream(output) << to_json(run);
  };
  for (const std::string& name : given["name"].as<std::vector<std::string>>()) run_table(name, options);
  return std::ifstream(output) ? 0 : 1;
}

int results(const std::vector<std::string>& arguments) {
  po::options_description known;
  po::positional_options_description positional;
  positional.add("file", -1);
  known.add_options()("file", po::value<std::vector<std::string>>()->required())("output,o", po::value<std::string>()->required())(
      "micro", po::value<std::string>()->default_value(""));
  po::variables_map given;
  po::store(po::command_line_parser(arguments).options(known).positional(positional).run(), given);
  po::notify(given);
  std::vector<Measurements> runs;
  for (const std::string& file : given["file"].as<std::vector<std::string>>()) runs.push_back(read_run(file));
  write_results(runs, given["micro"].as<std::string>(), given["output"].as<std::string>());
  return 0;
}

int compare(const std::vector<std::string>& arguments) {
  if (arguments.size() != 2) throw std::runtime_error("compare needs two files.");
  int matched = 0;
  const std::vector<std::string> lines = regressions(read_run(arguments[0]), read_run(arguments[1]), &matched);
  for (const std::string& line : lines) std::cout << "warning: " << line << "\n";
  std::cout << matched << " measurements in both, " << lines.size() << (lines.size() == 1 ? " warning\n" : " warnings\n");
  return lines.empty() ? 0 : 1;
}

}  // namespace

int main(int argc, char** argv) {
  const std::vector<std::string> arguments(argv + std::min(argc, 2), argv + argc);
  const std::string command = argc > 1 ? argv[1] : "";
  try {
    if (command == "tables") return tables(arguments);
    if (command == "results") return results(arguments);
    if (command == "compare") return compare(arguments);
    if (command == "micro") return run_micro(argc - 1, argv + 1);
  } catch (const std::exception& error) {
    std::cerr << "rayrep_bench: " << error.what() << "\n";
    return 2;
  }
  std::cerr << kUsage;
  for (const std::string& name : table_names()) std::cerr << " " << name;
  std::cerr << "\n";
  return command == "--help" || command == "-h" ? 0 : 2;
}
