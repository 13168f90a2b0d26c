#pragma once

#include <filesystem>
#include <string>

namespace rayrep::test {

/// Where this build finds things. Functions of one source, so that builds of other checkouts find the rest of the tests in ccache.
std::filesystem::path source_folder();
std::filesystem::path shared_meshes();
/// The command rayrep.
const std::string& tool();

}  // namespace rayrep::test
