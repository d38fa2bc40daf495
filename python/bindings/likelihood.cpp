#include "python/bindings/likelihood.h"

#include <nanobind/stl/optional.h>
#include <nanobind/stl/pair.h>
#include <nanobind/stl/tuple.h>
#include <nanobind/stl/vector.h>

#include <future>
#include <memory>
#include <optional>
#include <tuple>
#include <utility>
#include <vector>

#include "python/bindings/replay.h"
#include "sysid/infer/motion_likelihood.h"

namespace flash::python {

namespace nb = nanobind;

namespace {

/// A motion and what it is of.
using Given = std::tuple<const PreparedReplay*, Numbers, Numbers>;
using OfRecordings = std::vector<Given>;  ///< one a recording

sysid::Motions motions_of(const OfRecordings& given) {
  sysid::Motions motions;
  for (const auto& [prepared, positions, forces] : given) {
    motions.replays.push_back(prepared->ready.replay);
    motions.results.push_back(
        {.motion = motion_of(*prepared, positions, forces), .converged = true, .finite = true});
  }
  return motions;
}

class Likelihood {
 public:
  /// `beside`: of each parameter, motions of all recordings at a lower and at a higher value.
  Likelihood(const OfRecordings& reference, const std::vector<std::pair<OfRecordings, OfRecordings>>& beside,
             std::optional<double> repeatability) {
    const nb::gil_scoped_release release;
    const sysid::Motions at = motions_of(reference);
    std::vector<sysid::MotionChange> rates;
    for (const auto& [low, high] : beside)
      rates.push_back({{-1, std::make_shared<const sysid::Motions>(motions_of(low))},
                       {1, std::make_shared<const sysid::Motions>(motions_of(high))}});
    threads_ = at.replays.front().settings.threads;
    likelihood_ = std::make_unique<const sysid::MotionLikelihood>(at.replays, at.results,
                                                                  sysid::ScoreSettings{}, repeatability,
                                                                  std::vector<sysid::KnownError>{}, rates);
  }

  double log(const OfRecordings& given) const {
    const nb::gil_scoped_release release;
    std::vector<sysid::Motion> motions;
    for (sysid::ReplayResult& result : motions_of(given).results) motions.push_back(std::move(result.motion));
    return -0.5 * likelihood_->deviance(motions, threads_);
  }

  std::vector<double> spreads() const {
    std::vector<double> all;
    for (std::size_t r = 0; r < likelihood_->recordings(); ++r)
      all.push_back(likelihood_->of_recording(r).spread());
    return all;
  }

 private:
  std::unique_ptr<const sysid::MotionLikelihood> likelihood_;
  int threads_ = 1;
};

}  // namespace

void bind_likelihood(nb::module_& module) {
  nb::class_<Likelihood>(module, "MotionLikelihood")
      .def(nb::init<const OfRecordings&, const std::vector<std::pair<OfRecordings, OfRecordings>>&,
                    std::optional<double>>(),
           nb::arg("reference"), nb::arg("beside"), nb::arg("repeatability").none())
      .def("log", &Likelihood::log)
      .def("spreads", &Likelihood::spreads);
}

}  // namespace flash::python
