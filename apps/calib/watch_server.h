#pragma once
#include <memory>
#include <string>

namespace flash {

/// A page on this machine's own address, 127.0.0.1, that nobody else reaches: it answers GET alone, and only
/// where the Host of a request is that address, so that no other site can read it through a browser.
///   /         the page
///   /state    the JSON of show(); 204 where ?after=N names the one that is shown
///   /picture  the bytes of show()
class WatchServer {
 public:
  /// port 0: any that is free. Throws data::InputError where the port is taken.
  WatchServer(std::string page, int port);
  ~WatchServer();
  WatchServer(const WatchServer&) = delete;
  WatchServer& operator=(const WatchServer&) = delete;

  int port() const;

  /// What is served from now on. picture: bytes of a PNG, JPEG or BMP, or null.
  void show(std::string state, std::shared_ptr<const std::string> picture);

 private:
  struct Served;
  std::unique_ptr<Served> served_;
};

}  // namespace flash
