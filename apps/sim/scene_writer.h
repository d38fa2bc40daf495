#pragma once
#include <chrono>
#include <set>
#include <string>
#include <vector>

#include "data/mesh/mesh.h"
#include "data/scene/scene.h"
#include "sim/newton/step_report.h"
#include "sim/scene/scene.h"
#include "sim/step/contact_force.h"

namespace flash::sim {

/// What run_scene writes of one environment of a scene: frames, and tables that grow with the steps.
class SceneWriter {
 public:
  /// `bodies`: as they start.
  SceneWriter(const data::Scene& scene, const std::vector<SceneBody>& bodies, int steps, bool with_contacts,
              std::string output_dir);

  /// Takes away what a former run has left, and writes the frame of the start.
  void begin();

  /// Rows of the step that ends at `time` [s]; `reports`: of each body.
  void add_step(int step, double time, const std::vector<SceneBody>& bodies,
                const std::vector<StepReport>& reports);

  bool wants_frame(int step) const { return frame_steps_.count(step) > 0; }
  void write_frame(int step, const std::vector<SceneBody>& bodies);
  void write_contacts(int step, double time, const std::vector<SceneBody>& bodies,
                      const std::vector<std::vector<ContactForce>>& contacts);

  void write_tables();
  /// Every ten seconds: a run that is killed leaves them as they were some seconds before.
  void write_tables_at_times();

  int frames() const { return frames_; }  ///< written

 private:
  std::string path_of(const char* folder, int step, const char* ending) const;
  void write_mesh(int step, const data::TriangleMesh& mesh);

  std::string output_dir_;
  std::set<int> frame_steps_;
  data::TriangleMesh at_start_;
  bool with_contacts_, self_contact_, yields_;
  std::string log_, forces_, resultants_;
  int frames_ = 0;
  std::chrono::steady_clock::time_point tables_written_ = std::chrono::steady_clock::now();
};

}  // namespace flash::sim
