#include "apps/sim/environment_table.h"

#include <algorithm>

#include "apps/sim/csv_text.h"
#include "data/files/text.h"
#include "data/numbers/worst.h"
#include "sim/newton/accepted.h"

namespace flash::sim {

bool is_usable(const EnvironmentFigures& figures) {
  return figures.why_lost.empty() &&
         accepted(double(figures.unconverged_steps) / std::max(1, figures.steps), figures.residual_max);
}

void add_step(const std::vector<Worlds>& worlds, std::vector<EnvironmentFigures>& figures) {
  for (std::size_t e = 0; e < figures.size(); ++e) {
    EnvironmentFigures& own = figures[e];
    bool converged = true, halved = false;
    own.kinetic = own.elastic = 0;
    for (const Worlds& of_object : worlds) {
      const StepReport& report = of_object.report(static_cast<int>(e));
      if (own.why_lost.empty()) own.why_lost = of_object.why_lost(static_cast<int>(e));
      converged = converged && report.converged;
      halved = halved || report.substeps > 1;
      own.residual_max = data::worst(own.residual_max, report.residual);
      own.penetration_max = data::worst(own.penetration_max, report.penetration_max);
      own.iterations += report.iterations;
      own.kinetic += report.kinetic;
      own.elastic += report.membrane + report.bending + report.solid;
    }
    ++own.steps;
    own.unconverged_steps += !converged;
    own.halved_steps += halved;
  }
}

std::string environment_table(const std::vector<Variation>& variations,
                              const std::vector<EnvironmentFigures>& figures) {
  std::string table = "environment";
  for (const Variation& variation : variations) table += "," + variation.name;
  table +=
      ",steps,unconverged_steps,halved_steps,residual_max,penetration_max_m,iterations,kinetic_J,elastic_J,"
      "usable,lost\n";
  for (std::size_t e = 0; e < figures.size(); ++e) {
    const EnvironmentFigures& own = figures[e];
    table += std::to_string(e);
    for (std::size_t k = 0; k < variations.size(); ++k)
      table += "," + data::format_number(factor_of(variations, k, static_cast<int>(e)));
    for (const long count : {long(own.steps), long(own.unconverged_steps), long(own.halved_steps)})
      table += "," + std::to_string(count);
    table += "," + data::format_number(own.residual_max) + "," + data::format_number(own.penetration_max);
    table += "," + std::to_string(own.iterations);
    table += "," + data::format_number(own.kinetic) + "," + data::format_number(own.elastic);
    table += std::string(is_usable(own) ? ",1," : ",0,") + csv_field(own.why_lost) + "\n";
  }
  return table;
}

}  // namespace flash::sim
