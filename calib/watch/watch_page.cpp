#include "calib/watch/watch_page.h"

#include <nlohmann/json.hpp>
#include <string_view>

#include "data/picture/html_page.h"

namespace flash::embedded {
std::string_view watch_page();
}  // namespace flash::embedded

namespace flash::calib {

std::string watch_page(const std::string& folder) {
  const nlohmann::json data = {{"folder", folder}};
  const std::string text =
      data::inside_script(data.dump(-1, ' ', false, nlohmann::json::error_handler_t::replace));
  return data::fill_page(embedded::watch_page(), {{"@DATA@", text}});
}

}  // namespace flash::calib
