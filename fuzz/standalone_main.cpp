// Runs a fuzz target without libFuzzer, so that it compiles with any compiler and runs as a test: over the files named on the
// command line, or in the folders named there, and over seeded random changes of them. The same arguments do the same work.
//
//   fuzz_NAME [--mutations N (0)] FILE|FOLDER...

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <exception>
#include <filesystem>
#include <fstream>
#include <iostream>
#include <iterator>
#include <random>
#include <string>
#include <string_view>
#include <vector>

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size);  // NOLINT(readability-identifier-naming)

namespace {

using Random = std::mt19937_64;

std::size_t below(Random& random, std::size_t limit) { return static_cast<std::size_t>(random() % limit); }

/// One random change of everything but the first byte, by which targets choose what they do.
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
      bytes.insert(at, bytes.substr(std::min(bytes.size(), 1 + below(random, bytes.size())), 1 + below(random, 64)));
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
    std::ofstream("fuzz.failed", std::ios::binary) << bytes;
    std::cerr << name << ": " << violation.what() << "; the input is in fuzz.failed\n";
    return false;
  }
}

/// The files, and those in the folders, by name.
std::vector<std::string> files_in(const std::vector<std::string>& paths) {
  std::vector<std::string> files;
  for (const std::string& path : paths) {
    if (!std::filesystem::is_directory(path)) {
      files.push_back(path);
      continue;
    }
    for (const auto& entry : std::filesystem::directory_iterator(path)) files.push_back(entry.path().string());
  }
  std::sort(files.begin(), files.end());
  return files;
}

}  // namespace

int main(int argc, char** argv) {
  std::uint64_t mutations = 0;
  std::vector<std::string> paths;
  for (int i = 1; i < argc; ++i) {
    if (std::string_view(argv[i]) == "--mutations" && i + 1 < argc)
      mutations = std::strtoull(argv[++i], nullptr, 10);
    else
      paths.emplace_back(argv[i]);
  }
  std::vector<std::string> inputs;
  for (const std::string& path : files_in(paths)) {
    std::ifstream file(path, std::ios::binary);
    inputs.emplace_back(std::istreambuf_iterator<char>(file), std::istreambuf_iterator<char>());
    if (!file || inputs.back().empty()) {
      std::cerr << "nothing in " << path << "\n";
      return 2;
    }
    // A crash that ends the process is found again from the last line printed.
    std::cout << path << std::endl;
    if (!run(inputs.back(), path)) return 1;
  }
  if (inputs.empty()) {
    std::cerr << "no files\n";
    return 2;
  }
  for (std::uint64_t i = 0; i < mutations; ++i) {
    if (i % 1000 == 0) std::cout << "mutation " << i << " of " << mutations << std::endl;
    Random random(i);
    std::string bytes = inputs[i % inputs.size()];
    for (std::size_t changes = 1 + below(random, 6); changes > 0; --changes) mutate(bytes, random);
    if (!run(bytes, "mutation " + std::to_string(i))) return 1;
  }
  return 0;
}
