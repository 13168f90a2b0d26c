#pragma once

// How the judges write figures.

#include <Eigen/Core>
#include <string>
#include <variant>
#include <vector>

#include "rayrep/base/figure.h"
#include "rayrep/judge/verify.h"
#include "rayrep/physics/moments.h"
#include "rayrep/physics/spec.h"

namespace rayrep::verify_detail {

std::vector<double> list(const Eigen::Ref<const Eigen::VectorXd>& v);
std::vector<std::vector<double>> rows(const Eigen::Ref<const Eigen::MatrixXd>& m);
/// None if it is absent.
Figure::Value value_or_none(const std::optional<Eigen::Vector3d>& point);

/// Mass, centre of mass and inertia. @param mass_words  of the mass in a table; empty: not there
Figures body_figures(const MassProperties& body, const char* mass_words);

/// "material 1.24 g/cm3, wall 1.2 mm": the end of every headline.
std::string print_words(const Print& print);
void add_print(const Print& print, Figures& wanted);

/// In front of those that are there: of a body before it was hollowed come as many.
void put_first(Figures first, Figures& figures);

/// What a verdict was held to, of that type; null: it was not.
template <typename T>
const T* wanted_of(const Verdict& verdict, const std::string& name) {
  for (const Figure& figure : verdict.wanted)
    if (figure.name == name) return std::get_if<T>(&figure.value);
  return nullptr;
}

/// "12.3 degrees"
std::string degrees(double rad, int digits);

/// "42.6 g": what can be told on a scale that suits it, to 1 % or better from 0.1 g on
std::string grams(double mass_g);

/// "(1.000, 2.000, 3.000) mm"
std::string place_words(const Eigen::Vector3d& p);

}  // namespace rayrep::verify_detail
