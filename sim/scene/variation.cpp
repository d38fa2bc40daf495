#include "sim/scene/variation.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>

#include "data/files/error.h"
#include "data/files/text.h"

namespace flash::sim {

namespace {

/// Of the Halton points, one for each thing that may differ.
constexpr std::array<int, variation_names.size()> bases = {2, 3, 5, 7};

/// The digits of `number` mirrored at the point: in [0, 1).
double radical_inverse(int number, int base) {
  double inverse = 0, place = 1.0 / base;
  for (; number > 0; number /= base, place /= base) inverse += place * (number % base);
  return inverse;
}

void scale_friction(double factor, Environment& environment) {
  for (data::SheetMaterial& material : environment.materials) material.friction *= factor;
  for (auto& [body, solid] : environment.solids) solid.friction *= factor;
  for (Obstacle& obstacle : environment.obstacles)
    for (double& friction : obstacle.friction) friction *= factor;
  if (environment.self_contact) environment.self_contact->friction *= factor;
}

bool has_friction(const Environment& environment) {
  bool found = environment.self_contact && environment.self_contact->friction > 0;
  for (const data::SheetMaterial& material : environment.materials) found = found || material.friction > 0;
  for (const auto& [body, solid] : environment.solids) found = found || solid.friction > 0;
  for (const Obstacle& obstacle : environment.obstacles)
    for (const double friction : obstacle.friction) found = found || friction > 0;
  return found;
}

void scale(const std::string& name, double factor, Environment& environment) {
  if (name == "friction") return scale_friction(factor, environment);
  for (data::SheetMaterial& material : environment.materials) {
    if (name == "young") material.membrane_stiffness *= factor;
    if (name == "bending") material.bending_rigidity *= factor;
    if (name == "density") material.areal_density *= factor;
  }
  for (auto& [body, solid] : environment.solids) {
    if (name == "young") solid.youngs_modulus *= factor;
    if (name == "density") solid.density *= factor;
  }
}

Variation parse_one(std::string_view text, const std::string& option) {
  const auto refuse = [&](const std::string& expected) {
    throw data::InputError(option + ": found \"" + std::string(text) + "\", expected " + expected);
  };
  Variation variation;
  const std::size_t equals = text.find('=');
  variation.name = text.substr(0, equals);
  if (std::find(variation_names.begin(), variation_names.end(), variation.name) == variation_names.end() ||
      equals == std::string_view::npos)
    refuse("young, bending, density or friction with a range of its factor, as bending=0.5:2:log");
  const std::vector<std::string_view> words = data::split(text.substr(equals + 1), ":");
  const auto number = [&](std::size_t k) {
    return k < words.size() ? data::parse_number(words[k]) : std::nullopt;
  };
  const std::optional<double> low = number(0), high = number(1);
  variation.logarithmic = words.size() == 3 && words[2] == "log";
  if (words.size() < 2 || words.size() > 3 || (words.size() == 3 && !variation.logarithmic) || !low ||
      !high || !(*low > 0 && *low < *high && std::isfinite(*high)))
    refuse("low:high or low:high:log with 0 < low < high: factors on what the scene has");
  variation.low = *low;
  variation.high = *high;
  return variation;
}

}  // namespace

std::vector<Variation> parse_variations(const std::string& text, const std::string& option) {
  std::vector<Variation> variations;
  for (const std::string_view word : data::split(text, ",")) {
    const Variation variation = parse_one(word, option);
    for (const Variation& other : variations)
      if (other.name == variation.name)
        throw data::InputError(option + ": found " + variation.name + " twice, expected each once");
    variations.push_back(variation);
  }
  return variations;
}

bool applies(const Variation& variation, const Environment& environment) {
  if (variation.name == "friction") return has_friction(environment);
  if (variation.name != "bending") return true;
  for (std::size_t body = 0; body < environment.materials.size(); ++body)
    if (environment.solids.count(static_cast<int>(body)) == 0 &&
        environment.materials[body].bending_rigidity > 0)
      return true;
  return false;
}

double factor_of(const std::vector<Variation>& variations, std::size_t index, int number) {
  if (number == 0) return 1;
  const Variation& variation = variations[index];
  const double share = radical_inverse(number + 1, bases[index]);
  return variation.logarithmic ? variation.low * std::pow(variation.high / variation.low, share)
                               : variation.low + share * (variation.high - variation.low);
}

Environment varied(Environment environment, const std::vector<Variation>& variations, int number) {
  for (std::size_t k = 0; k < variations.size(); ++k)
    scale(variations[k].name, factor_of(variations, k, number), environment);
  return environment;
}

}  // namespace flash::sim
