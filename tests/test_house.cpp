// The rules of the house (docs/architecture.md), checked on the text of the sources: include directions, where third-party
// libraries may be seen, what the library never does.

#include <gtest/gtest.h>

#include <algorithm>
#include <cctype>
#include <filesystem>
#include <fstream>
#include <map>
#include <regex>
#include <set>
#include <sstream>
#include <string>
#include <vector>

#include "places.h"

namespace {

namespace fs = std::filesystem;
using Problems = std::vector<std::string>;

/// The layers: each folder of src/ and include/rayrep/ and the folders that its files may include besides their own.
const std::map<std::string, std::set<std::string>> kFolders = {
    {"base", {}},
    {"mesh", {"base"}},
    {"io", {"base", "mesh", "physics"}},
    {"physics", {"base", "mesh"}},
    {"rays", {"base", "mesh", "physics"}},
    {"solve", {"base", "mesh", "physics", "rays"}},
    {"make", {"base", "mesh", "physics", "rays", "solve"}},
    {"shape", {"base", "mesh", "physics", "rays", "solve", "make"}},
    {"print", {"base", "mesh", "io", "physics"}},
    {"draw", {"base", "mesh", "physics"}},
    {"motion", {"base", "mesh", "io", "physics"}},
    {"judge", {"base", "mesh", "io", "physics"}},
    {"advice", {"base", "mesh", "physics", "rays", "solve", "make", "shape", "judge"}},
    {"report", {"base", "mesh", "io", "physics", "rays", "solve", "make", "print", "motion", "judge"}},
};

/// Third-party headers, by the beginning of their names, and the only sources that may include them; empty: any source.
const std::map<std::string, std::set<std::string>> kThirdParty = {
    {"Eigen/", {}},
    {"tbb/", {}},
    {"embree3/", {"surface_query"}},
    {"openvdb/", {"level_set"}},
    {"coin/", {"solve_ipopt"}},
    {"Ip", {"solve_ipopt"}},
    {"pugixml.hpp", {"mesh_io_3mf", "urdf_file"}},
    {"zip.h", {"archive"}},
    {"png.h", {"png_rows"}},
    {"cairo.h", {"drawing_png"}},
    {"nlohmann/", {"json", "html", "motion_json", "scene_file", "scene_page", "scene_gltf", "balance_page"}},
    {"fmt/", {"text", "words"}},
    {"httplib.h", {"server"}},
    {"boost/", {}},
};

/// What the library never does: it does not print, end the process, look at a clock or draw unseeded numbers.
const std::vector<std::string> kNeverInLibrary = {
    R"(\bstd::(cout|cerr|clog|wcout|wcerr|cin)\b)",
    R"(\b(printf|fprintf|vprintf|vfprintf|puts|fputs|putchar|perror)\s*\()",
    R"(\bstd::print(ln)?\b)",
    R"(\b(exit|_exit|_Exit|quick_exit|abort)\s*\()",
    R"(\bstd::terminate\b)",
    R"(\bstd::chrono\b)",
    R"(\b(clock|clock_gettime|gettimeofday)\s*\()",
    R"(\bstd::time\b)",
    R"(\b(rand|srand|random|drand48)\s*\()",
    R"(\brandom_device\b)",
    R"(\bgetenv\s*\()",
};

const std::vector<std::string> kNeverInPublicHeaders = {
    R"(\btbb::)",  R"(\bnlohmann\b)", R"(\bopenvdb\b)", R"(\bRTC[A-Z]\w*)", R"(\bIpopt\b)",           R"(\bboost::)",
    R"(\bpugi::)", R"(\bzip_t\b)",    R"(\bpng_\w+)",   R"(\bcairo_\w+)",   R"(\busing namespace\b)",
};

enum class Place { public_header, library_source };

/// The text with comments, and if asked the contents of string and character literals, turned into spaces. Keeps line breaks.
std::string blanked(const std::string& text, bool strings_too) {
  std::string out = text;
  const auto blank = [&out](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < std::min(end, out.size()); ++i)
      if (out[i] != '\n') out[i] = ' ';
  };
  std::size_t i = 0;
  while (i < text.size()) {
    const std::string two = text.substr(i, 2);
    std::size_t end = i + 1;
    if (two == "//") {
      end = std::min(text.find('\n', i), text.size());
      blank(i, end);
    } else if (two == "/*") {
      const std::size_t close = text.find("*/", i + 2);
      end = close == std::string::npos ? text.size() : close + 2;
      blank(i, end);
    } else if (two == "R\"") {
      const std::size_t open = std::min(text.find('(', i), text.size());
      const std::size_t close = text.find(")" + text.substr(i + 2, open - i - 2) + "\"", open);
      end = close == std::string::npos ? text.size() : close + open - i;
      if (strings_too) blank(i + 2, end - 1);
    } else if (text[i] == '"' || (text[i] == '\'' && (i == 0 || !std::isalnum(static_cast<unsigned char>(text[i - 1]))))) {
      while (end < text.size() && text[end] != text[i] && text[end] != '\n') end += text[end] == '\\' ? 2 : 1;
      if (strings_too) blank(i + 1, end);
      ++end;
    }
    i = end;
  }
  return out;
}

struct Include {
  std::string name;
  bool quoted;
};

std::vector<Include> includes_of(const std::string& text) {
  static const std::regex kInclude(R"re((^|\n)[ \t]*#[ \t]*include[ \t]*(["<])([^">\n]+)[">])re");
  const std::string code = blanked(text, false);
  std::vector<Include> found;
  for (std::sregex_iterator it(code.begin(), code.end(), kInclude), end; it != end; ++it)
    found.push_back({(*it)[3], (*it)[2] == "\""});
  return found;
}

void check_own_include(const std::string& folder, const std::string& included, Problems& problems) {
  static const std::regex kOwn(R"((rayrep/)?([a-z]+)/\w+\.h)");
  std::smatch match;
  if (!std::regex_match(included, match, kOwn) || !kFolders.contains(match[2]))
    problems.push_back("includes \"" + included + "\", which is in no folder of kFolders: name it from src/ or include/");
  else if (match[2] != folder && !kFolders.at(folder).contains(match[2]))
    problems.push_back("in " + folder + "/ may not include \"" + included + "\" of " + match[2].str() + "/");
}

void check_foreign_include(const std::string& unit, const std::string& included, Place place, Problems& problems) {
  static const std::regex kStandard(R"([a-z_0-9]+)");
  static const std::regex kSystem(R"((sys/)?[a-z]+\.h)");
  for (const auto& [prefix, sources] : kThirdParty) {
    if (included.rfind(prefix, 0) != 0) continue;
    if (place == Place::public_header && prefix != "Eigen/")
      problems.push_back("includes <" + included + ">: public headers may show no third-party library but Eigen");
    else if (!sources.empty() && !sources.contains(unit))
      problems.push_back("includes <" + included + ">, which only " + *sources.begin() + ".cpp may see");
    return;
  }
  if (std::regex_match(included, kStandard)) return;
  if (place == Place::library_source && std::regex_match(included, kSystem)) return;
  problems.push_back("includes <" + included + ">, which is neither a standard header nor in kThirdParty of tests/test_house.cpp");
}

/// Everything in the text of one file that breaks a rule of the house.
Problems problems_of(const std::string& path, const std::string& text, Place place) {
  Problems problems;
  const std::string unit = fs::path(path).stem();
  const std::string folder = fs::path(path).parent_path().filename();
  if (!kFolders.contains(folder)) {
    problems.push_back(path + ": lies in no folder of kFolders in tests/test_house.cpp");
    return problems;
  }
  for (const Include& include : includes_of(text)) {
    if (include.quoted)
      check_own_include(folder, include.name, problems);
    else
      check_foreign_include(unit, include.name, place, problems);
  }

  static const std::vector<std::regex> kInLibrary(kNeverInLibrary.begin(), kNeverInLibrary.end());
  static const std::vector<std::regex> kInPublicHeaders(kNeverInPublicHeaders.begin(), kNeverInPublicHeaders.end());
  std::istringstream lines(blanked(text, true));
  std::string line;
  for (int number = 1; std::getline(lines, line); ++number) {
    const auto search = [&](const std::vector<std::regex>& forbidden) {
      std::smatch match;
      for (const std::regex& pattern : forbidden)
        if (std::regex_search(line, match, pattern))
          problems.push_back("line " + std::to_string(number) + ": '" + match.str() + "' has no place here");
    };
    search(kInLibrary);
    if (place == Place::public_header) search(kInPublicHeaders);
  }
  if (fs::path(path).extension() == ".h" && text.find("#pragma once") == std::string::npos)
    problems.push_back("lacks #pragma once");

  for (std::string& problem : problems) problem = path + ": " + problem;
  return problems;
}

// ------------------------------------------------------------------------------------------------------------- functions

/// Of a place in a text, counted from 1.
std::string line_at(const std::string& text, std::size_t place) {
  return "line " + std::to_string(1 + std::count(text.begin(), text.begin() + static_cast<std::ptrdiff_t>(place), '\n'));
}

std::size_t skip_space(const std::string& code, std::size_t i) {
  while (i < code.size() && std::isspace(static_cast<unsigned char>(code[i]))) ++i;
  return i;
}

/// One past the bracket that closes the one at `open`; npos if none does.
std::size_t past_bracket(const std::string& code, std::size_t open) {
  std::string closing;
  for (std::size_t i = open; i < code.size(); ++i) {
    if (code[i] == '(' || code[i] == '[' || code[i] == '{') closing += code[i] == '(' ? ')' : code[i] == '[' ? ']' : '}';
    if (code[i] != ')' && code[i] != ']' && code[i] != '}') continue;
    if (closing.back() != code[i]) return std::string::npos;
    closing.pop_back();
    if (closing.empty()) return i + 1;
  }
  return std::string::npos;
}

/// The list between brackets at its commas; those of template arguments do not count in what declares parameters.
std::vector<std::string> at_commas(const std::string& list) {
  std::vector<std::string> parts(1);
  int depth = 0;
  for (std::size_t i = 0; i < list.size(); ++i) {
    if (std::string("([{<").find(list[i]) != std::string::npos) ++depth;
    if (std::string(")]}").find(list[i]) != std::string::npos || (list[i] == '>' && i > 0 && list[i - 1] != '-')) --depth;
    if (list[i] == ',' && depth == 0)
      parts.emplace_back();
    else
      parts.back() += list[i];
  }
  return parts;
}

bool declares_a_parameter(const std::string& part) {
  static const std::regex kParameter(R"(^\s*(const\s+)?[\w:]+(<[^;]*>)?(\s+const)?\s*[&*]*\s+\(?[&*]*\w[^+/]*)");
  return std::regex_search(part, kParameter);
}

/// Where the body begins that belongs to the parameter list ending before `i`: at its brace, past const and the like and past what
/// a constructor initialises; npos for what has none.
std::size_t body_of(const std::string& code, std::size_t i) {
  static const std::regex kWords(R"(^\s*((const|noexcept|override|final|&|->\s*[\w:<>,&* ]+)\s*)*)");
  std::smatch words;
  const std::string rest = code.substr(i, 200);
  if (std::regex_search(rest, words, kWords)) i += static_cast<std::size_t>(words.length());
  i = skip_space(code, i);
  if (i < code.size() && code[i] == ':' && code.compare(i, 2, "::") != 0) {
    do {
      i = code.find_first_of("({", i + 1);
      if (i == std::string::npos) return i;
      i = past_bracket(code, i);
      if (i == std::string::npos) return i;
      i = skip_space(code, i);
    } while (i < code.size() && code[i] == ',');
  }
  return i < code.size() && code[i] == '{' ? i : std::string::npos;
}

struct Function {
  std::string name;
  std::size_t begin;  ///< of its name, in the text
  std::size_t parameters = 0;
  std::size_t body_lines = 0;  ///< 0 where it is only declared
};

/// Functions and constructors, declared or defined, in code without comments and contents of strings.
std::vector<Function> functions_in(const std::string& code) {
  static const std::regex kCall(R"(([A-Za-z_~][\w~]*)\s*\()");
  static const std::set<std::string> kNoNames = {"if",     "for",    "while",   "switch",  "catch",
                                                 "return", "sizeof", "alignas", "decltype"};
  std::vector<Function> found;
  for (std::sregex_iterator it(code.begin(), code.end(), kCall), end; it != end; ++it) {
    Function f{(*it)[1], static_cast<std::size_t>(it->position())};
    const std::size_t open = f.begin + static_cast<std::size_t>(it->length()) - 1;
    const std::size_t past = past_bracket(code, open);
    if (kNoNames.contains(f.name) || past == std::string::npos) continue;
    const std::vector<std::string> parts = at_commas(code.substr(open + 1, past - open - 2));
    const bool empty = parts.size() == 1 && skip_space(parts[0], 0) == parts[0].size();
    if (!empty && !std::all_of(parts.begin(), parts.end(), declares_a_parameter)) continue;
    f.parameters = empty ? 0 : parts.size();
    if (const std::size_t body = body_of(code, past); body != std::string::npos)
      if (const std::size_t past_body = past_bracket(code, body); past_body != std::string::npos)
        f.body_lines = 1 + static_cast<std::size_t>(std::count(code.begin() + static_cast<std::ptrdiff_t>(body),
                                                               code.begin() + static_cast<std::ptrdiff_t>(past_body), '\n'));
    found.push_back(f);
  }
  return found;
}

constexpr std::size_t kMostParameters = 5;
constexpr std::size_t kMostLines = 85;

Problems large_functions(const std::string& text) {
  Problems problems;
  for (const Function& f : functions_in(blanked(text, true))) {
    if (f.parameters > kMostParameters)
      problems.push_back(line_at(text, f.begin) + ": " + f.name + " has " + std::to_string(f.parameters) + " parameters");
    if (f.body_lines > kMostLines)
      problems.push_back(line_at(text, f.begin) + ": " + f.name + " has " + std::to_string(f.body_lines) + " lines");
  }
  return problems;
}

// ----------------------------------------------------------------------------------------------------------------- prose

/// So far a line of prose must reach if the next word would fit: the formatter, which breaks what is too long but joins nothing,
/// leaves short ends.
constexpr std::size_t kTornBefore = 112;
constexpr std::size_t kTornLiteralBefore = 100;

bool torn_comment(const std::string& line, const std::string& next) {
  static const std::regex kComment(R"(^(.*?)(//[/!]?<?)( +)(\S.*)$)");
  std::smatch a, b;
  if (!std::regex_match(line, a, kComment) || !std::regex_match(next, b, kComment)) return false;
  if (b[1].str().find_first_not_of(' ') != std::string::npos) return false;           // code
  if (a[1].length() != b[1].length() || b[3].length() < a[3].length()) return false;  // another paragraph
  const std::string end = a[4], begin = b[4];
  if (std::string(".:;?!").find(end.back()) != std::string::npos) return false;  // a sentence may end anywhere
  if (!std::islower(static_cast<unsigned char>(begin[0])) && begin[0] != '(') return false;
  if (begin.find("  ") != std::string::npos) return false;                                       // a table
  if (end.find('=') != std::string::npos || begin.find('=') != std::string::npos) return false;  // formulas
  return line.size() + 1 + std::min(begin.find(' '), begin.size()) <= kTornBefore;
}

bool torn_literal(const std::string& line, const std::string& next) {
  static const std::regex kEnd(R"re(^.*[^\\n]"$)re");
  static const std::regex kBegin(R"re(^\s*"([^ "][^ "]*).*$)re");
  std::smatch word;
  return std::regex_match(line, kEnd) && std::regex_match(next, word, kBegin) &&
         line.size() + static_cast<std::size_t>(word[1].length()) <= kTornLiteralBefore;
}

Problems torn_prose(const std::string& text) {
  Problems problems;
  std::istringstream lines(text);
  std::string line, next;
  std::getline(lines, line);
  for (int number = 1; std::getline(lines, next); ++number, line = next)
    if (torn_comment(line, next) || torn_literal(line, next))
      problems.push_back("line " + std::to_string(number) + ": torn prose: the next words fit behind \"" + line + "\"");
  return problems;
}

std::string read(const fs::path& path) {
  std::ifstream file(path, std::ios::binary);
  std::ostringstream text;
  text << file.rdbuf();
  return text.str();
}

std::vector<fs::path> sources_below(const fs::path& folder) {
  std::vector<fs::path> found;
  for (const auto& entry : fs::recursive_directory_iterator(folder))
    if (entry.path().extension() == ".h" || entry.path().extension() == ".cpp") found.push_back(entry.path());
  std::sort(found.begin(), found.end());
  return found;
}

const fs::path kRoot = rayrep::test::source_folder();

/// Functions with more parameters for a reason: a signature of Ipopt's; the innermost loop, whose restricted pointers are promises
/// only as parameters.
const std::set<std::string> kLargeForAReason = {"src/solve/solve_ipopt.cpp: get_bounds_info",
                                                "src/rays/ray_integrals.cpp: sum_block"};

/// What makes of a number a text, or the reverse, by the locale that the program has set.
const std::vector<std::string> kDependsOnLocale = {
    R"((std::|[^:\w])v?sn?printf\s*\()",
    R"(\b[io]?stringstream\b)",
    R"(\bsto(f|d|ld|i|l|ul|ll|ull)\s*\()",
    R"(\b(strto(f|d|ld|l|ul|ll|ull)|ato[filq]|sscanf)\s*\()",
};

Problems locale_dependent(const std::string& text) {
  Problems problems;
  const std::string code = blanked(text, true);
  for (const std::string& pattern : kDependsOnLocale) {
    const std::regex forbidden(pattern);
    for (std::sregex_iterator it(code.begin(), code.end(), forbidden), end; it != end; ++it)
      problems.push_back(line_at(text, static_cast<std::size_t>(it->position())) + ": '" + it->str() +
                         "' depends on the locale: use base/text.h");
  }
  return problems;
}

/// The contents pages stand above all folders.
std::vector<fs::path> headers_in_folders() {
  std::vector<fs::path> headers = sources_below(kRoot / "include/rayrep");
  std::erase_if(headers, [](const fs::path& path) { return path.parent_path() == kRoot / "include/rayrep"; });
  return headers;
}

TEST(House, PublicHeadersKeepTheRules) {
  const auto headers = headers_in_folders();
  ASSERT_GE(headers.size(), 15u);
  for (const fs::path& path : headers)
    for (const std::string& problem : problems_of(path.lexically_relative(kRoot), read(path), Place::public_header))
      ADD_FAILURE() << problem;
}

TEST(House, LibrarySourcesKeepTheRules) {
  const auto sources = sources_below(kRoot / "src");
  ASSERT_GE(sources.size(), 10u);
  for (const fs::path& path : sources)
    for (const std::string& problem : problems_of(path.lexically_relative(kRoot), read(path), Place::library_source))
      ADD_FAILURE() << problem;
}

/// rayrep.h (what is promised) and pieces.h (what it is made of) are the contents pages: together they name every public header.
TEST(House, ContentsPagesNameEveryHeaderOnce) {
  std::multiset<std::string> named;
  for (const char* page : {"rayrep.h", "pieces.h"})
    for (const Include& include : includes_of(read(kRoot / "include/rayrep" / page)))
      if (include.name != "rayrep/rayrep.h") named.insert(include.name);
  std::multiset<std::string> present;
  for (const fs::path& path : headers_in_folders()) present.insert(path.lexically_relative(kRoot / "include"));
  EXPECT_EQ(named, present);
}

std::vector<fs::path> library_files() {
  std::vector<fs::path> files = sources_below(kRoot / "src");
  const std::vector<fs::path> headers = sources_below(kRoot / "include");
  files.insert(files.end(), headers.begin(), headers.end());
  return files;
}

TEST(House, NumbersDoNotDependOnTheLocale) {
  for (const fs::path& path : library_files()) {
    const std::string name = path.lexically_relative(kRoot);
    for (const std::string& problem : locale_dependent(read(path))) ADD_FAILURE() << name << ": " << problem;
  }
}

TEST(House, NumbersAreRoundedToFloat32InOnePlace) {
  const std::regex there_and_back(R"(cast<float>\(\)\s*\.\s*cast<double>|static_cast<double>\(static_cast<float>\()");
  for (const fs::path& path : library_files()) {
    EXPECT_FALSE(std::regex_search(read(path), there_and_back)) << path << ": use as_float32";
  }
}

TEST(House, FunctionsAreSmall) {
  std::size_t functions = 0;
  for (const fs::path& path : library_files()) {
    const std::string name = path.lexically_relative(kRoot);
    functions += functions_in(blanked(read(path), true)).size();
    for (const std::string& problem : large_functions(read(path))) {
      const std::size_t begin = problem.find(": ") + 2;
      const std::string function = name + ": " + problem.substr(begin, problem.find(' ', begin) - begin);
      if (!kLargeForAReason.contains(function)) ADD_FAILURE() << name << ": " << problem;
    }
  }
  EXPECT_GE(functions, 500u) << "the parser has gone blind";
}

TEST(House, ProseIsNotTorn) {
  for (const fs::path& path : library_files()) {
    const std::string name = path.lexically_relative(kRoot);
    for (const std::string& problem : torn_prose(read(path))) ADD_FAILURE() << name << ": " << problem;
  }
}

TEST(House, FoldersFormNoCircle) {
  for (const auto& [folder, included] : kFolders) {
    EXPECT_TRUE(fs::is_directory(kRoot / "src" / folder)) << folder;
    std::set<std::string> reached;
    std::vector<std::string> open(included.begin(), included.end());
    while (!open.empty()) {
      const std::string next = open.back();
      open.pop_back();
      ASSERT_TRUE(kFolders.contains(next)) << next;
      if (reached.insert(next).second) open.insert(open.end(), kFolders.at(next).begin(), kFolders.at(next).end());
    }
    EXPECT_FALSE(reached.contains(folder)) << folder << " includes itself by way of others";
  }
}

TEST(House, OneSourceOfTheCommandSeesHttplib) {
  std::vector<std::string> seen_in;
  for (const fs::path& path : sources_below(kRoot / "tools"))
    for (const Include& include : includes_of(read(path)))
      if (include.name == "httplib.h") seen_in.push_back(path.lexically_relative(kRoot));
  EXPECT_EQ(seen_in, std::vector<std::string>{"tools/studio/server.cpp"});
}

TEST(House, TestsMirrorTheFolders) {
  for (const fs::path& path : sources_below(kRoot / "tests")) {
    const std::string folder = path.parent_path().filename();
    if (path.stem().string().rfind("test_", 0) != 0 || folder == "tests") continue;
    EXPECT_TRUE(kFolders.contains(folder) || folder == "tools") << path;
  }
}

// The checker itself, on texts that break each rule once.

std::string joined(const Problems& problems) {
  std::string all;
  for (const std::string& problem : problems) all += problem + "\n";
  return all;
}

struct Case {
  const char* path;
  Place place;
  const char* text;
  const char* complaint;  ///< part of the only problem expected; nullptr: none
};

void expect_verdicts(const std::vector<Case>& cases) {
  for (const Case& c : cases) {
    SCOPED_TRACE(c.text);
    const Problems problems = problems_of(c.path, c.text, c.place);
    if (c.complaint == nullptr)
      EXPECT_EQ(joined(problems), "");
    else if (problems.size() != 1)
      ADD_FAILURE() << "one problem expected: " << c.complaint << "\nfound:\n" << joined(problems);
    else
      EXPECT_NE(problems[0].find(c.complaint), std::string::npos) << problems[0];
  }
}

constexpr Place kHeader = Place::public_header;
constexpr Place kSource = Place::library_source;

TEST(HouseChecker, FindsBadIncludes) {
  expect_verdicts(
      {Case{"include/rayrep/new/thing.h", kHeader, "#pragma once\n", "no folder"},
       Case{"include/rayrep/mesh/mesh.h", kHeader, "#pragma once\n#include \"rayrep/new/thing.h\"\n", "no folder"},
       Case{"include/rayrep/mesh/mesh.h", kHeader, "#pragma once\n#include \"rayrep/judge/verify.h\"\n", "may not include"},
       Case{"src/physics/hydrostatics.cpp", kSource, "#include \"rayrep/physics/moments.h\"\n#include \"mesh/mesh.h\"\n", nullptr},
       Case{"include/rayrep/judge/verify.h", kHeader, "#pragma once\n#include \"rayrep/rays/ray_cast.h\"\n", "may not include"},
       Case{"src/rays/ray_cast.cpp", kSource, "#include \"rayrep/solve/goals.h\"\n", "may not include"},
       Case{"src/rays/ray_cast.cpp", kSource, "#include \"ray_cast.h\"\n", "in no folder"},
       Case{"src/mesh/mesh.cpp", kSource, " # include <embree3/rtcore.h>\n", "only surface_query.cpp"},
       Case{"src/mesh/mesh.cpp", kSource, "#include <openvdb/openvdb.h>\n", "only level_set.cpp"},
       Case{"src/solve/solve.cpp", kSource, "#include <coin/IpTNLP.hpp>\n", "only solve_ipopt.cpp"},
       Case{"src/mesh/surface_query.cpp", kSource, "#include <embree3/rtcore.h>\n#include <vector>\n#include <sys/stat.h>\n",
            nullptr},
       Case{"src/mesh/mesh.cpp", kSource, "#include <CGAL/Surface_mesh.h>\n", "neither a standard header"},
       Case{"include/rayrep/mesh/mesh.h", kHeader, "#pragma once\n#include <tbb/blocked_range.h>\n", "no third-party"},
       Case{"include/rayrep/mesh/mesh.h", kHeader, "#pragma once\n#include <Eigen/Core>\n#include <vector>\n", nullptr},
       Case{"include/rayrep/mesh/mesh.h", kHeader, "#pragma once\n// #include \"rayrep/judge/verify.h\"\n", nullptr},
       Case{"include/rayrep/mesh/mesh.h", kHeader, "#include <vector>\n", "pragma once"}});
}

TEST(HouseChecker, FindsBadWords) {
  expect_verdicts(
      {Case{"src/mesh/mesh.cpp", kSource, "int a;\nvoid f() { std::cout << 1; }\n", "line 2: 'std::cout'"},
       Case{"src/mesh/mesh.cpp", kSource, "void f() { std::cerr << 1; }", "std::cerr"},
       Case{"src/mesh/mesh.cpp", kSource, "void f() { printf (\"x\"); }", "printf"},
       Case{"src/mesh/mesh.cpp", kSource, "void f() { std::fprintf(stderr, \"x\"); }", "fprintf"},
       Case{"src/mesh/mesh.cpp", kSource, "void f() { std::snprintf(b, 9, \"printf(\"); }", nullptr},
       Case{"src/mesh/mesh.cpp", kSource, "void f() { ::exit(1); }", "exit("},
       Case{"src/mesh/mesh.cpp", kSource, "void f() { std::abort(); }", "abort("},
       Case{"src/mesh/mesh.cpp", kSource, "void f() { auto t = std::chrono::steady_clock::now(); }", "std::chrono"},
       Case{"src/mesh/mesh.cpp", kSource, "int f() { return rand(); }", "rand("},
       Case{"src/mesh/mesh.cpp", kSource, "std::random_device d;", "random_device"},
       Case{"src/mesh/mesh.cpp", kSource, "// std::cout\n/* exit(1)\n rand() */ const char* s = \"abort()\";", nullptr},
       Case{"src/mesh/mesh.cpp", kSource, "const char* s = R\"x(exit(1))x\"; void f() { exit(1); }", "exit("},
       Case{"src/mesh/mesh.cpp", kSource, "const char* s = \"\\\"\"; char q = '\"'; int n = 1'000; void f() { exit(1); }", "exit("},
       Case{"src/mesh/mesh.cpp", kSource, "void f() { brand(); on_exit_(); operand(1); }", nullptr},
       Case{"include/rayrep/mesh/mesh.h", kHeader, "#pragma once\ntbb::task_arena& arena();\n", "tbb::"},
       Case{"include/rayrep/mesh/mesh.h", kHeader, "#pragma once\nnlohmann::json f();\n", "nlohmann"},
       Case{"include/rayrep/mesh/mesh.h", kHeader, "#pragma once\nvoid f(RTCScene s);\n", "RTCScene"},
       Case{"include/rayrep/mesh/mesh.h", kHeader, "#pragma once\nvoid f(Ipopt::TNLP&);\n", "Ipopt"},
       Case{"include/rayrep/mesh/mesh.h", kHeader, "#pragma once\nboost::any f();\n", "boost::"},
       Case{"include/rayrep/mesh/mesh.h", kHeader, "#pragma once\n/// Like openvdb::Grid.\nint f();\n", nullptr}});
}

TEST(HouseChecker, FindsWhatDependsOnTheLocale) {
  EXPECT_EQ(joined(locale_dependent("a();\nstd::snprintf(b, 9, \"x\");")),
            "line 2: 'std::snprintf(' depends on the locale: use base/text.h\n");
  for (const char* text :
       {"std::ostringstream s;", "std::stringstream s;", "auto d = std::stod(s);", "strtod(s, nullptr);", "atof(s)"})
    EXPECT_EQ(locale_dependent(text).size(), 1u) << text;
  EXPECT_TRUE(locale_dependent("// snprintf(\nstd::string s = \"stod(\"; number(1.5, 2); fmt::sprintf(p); std::to_chars(a, b, x);")
                  .empty());
}

TEST(HouseChecker, CountsParametersAndLines) {
  const auto only = [](const std::string& code) {
    const std::vector<Function> found = functions_in(code);
    EXPECT_EQ(found.size(), 1u) << code;
    return found.empty() ? Function{} : found[0];
  };
  EXPECT_EQ(only("int f(int a, const std::map<int, double>& b, double c = 1);").parameters, 3u);
  EXPECT_EQ(only("void f() const;").parameters, 0u);
  EXPECT_EQ(only("void f(int a, int b, int c, int d, int e, int f) {}").parameters, 6u);
  EXPECT_EQ(only("A::A(int a, const B& b, C* c, D d, E e, F f) : a_(a), b_{b} {\n}").parameters, 6u);
  EXPECT_EQ(only("A::A(int a, const B& b) : a_(a), b_{b} {\n\n}").body_lines, 3u);
  EXPECT_EQ(only("auto f(std::function<void(int, int)> g) const noexcept -> int {\n\n\n}").body_lines, 4u);
  EXPECT_TRUE(functions_in("x = f(a, b + 1, 2, 3, 4, 5); if (a) { } for (int i = 0; i < 3; ++i) {}").empty());
  EXPECT_EQ(joined(large_functions("\nvoid f(int a, int b, int c, int d, int e, int g);")), "line 2: f has 6 parameters\n");
  EXPECT_EQ(joined(large_functions("void f() {" + std::string(85, '\n') + "}")), "line 1: f has 86 lines\n");
  EXPECT_TRUE(large_functions("void f() {" + std::string(84, '\n') + "}").empty());
}

TEST(HouseChecker, FindsTornProse) {
  const std::string lead = "/// " + std::string(100, 'x');
  EXPECT_EQ(torn_prose("/// the last range (1.2\n/// times\n///           its lower end").size(), 2u);
  EXPECT_EQ(torn_prose(lead + "\n/// word\n").size(), 1u);
  EXPECT_TRUE(torn_prose(lead + " and more\n/// word\n").empty());
  EXPECT_TRUE(torn_prose("/// A sentence.\n/// another paragraph").empty());
  EXPECT_TRUE(torn_prose("/// and wall as there, then\n///   offset    a row of a table").empty());
  EXPECT_EQ(torn_prose("f(\"Filters, \"\n  \"Remeshing\");").size(), 1u);
  EXPECT_TRUE(torn_prose("f(\"a line\\n\"\n  \"another\");").empty());
}

}  // namespace
