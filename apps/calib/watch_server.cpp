#include "apps/calib/watch_server.h"

#include <httplib.h>
#include <sys/socket.h>

#include <mutex>
#include <thread>
#include <utility>

#include "data/files/error.h"

namespace flash {

struct WatchServer::Served {
  httplib::Server server;
  std::thread listening;
  int port = 0;
  std::string page;

  std::mutex mutex;  // of what follows
  long version = 0;
  std::string state = "null";
  std::shared_ptr<const std::string> picture;
};

namespace {

using httplib::Request;
using httplib::Response;

constexpr const char* kAddress = "127.0.0.1";

const char* type_of_picture(const std::string& bytes) {
  if (bytes.starts_with("\x89PNG")) return "image/png";
  return bytes.starts_with("BM") ? "image/bmp" : "image/jpeg";
}

bool is_own_host(const std::string& host, int port) {
  const std::string suffix = ":" + std::to_string(port);
  return host == kAddress + suffix || host == "localhost" + suffix;
}

/// Where this program listened a moment ago another may at once, but no two at a time.
void reuse_closed_port(socket_t socket) {
  const int yes = 1;
  setsockopt(socket, SOL_SOCKET, SO_REUSEADDR, &yes, sizeof yes);
}

}  // namespace

WatchServer::WatchServer(std::string page, int port) : served_(std::make_unique<Served>()) {
  Served& served = *served_;
  served.page = std::move(page);
  httplib::Server& server = served.server;
  server.set_socket_options(reuse_closed_port);
  server.set_tcp_nodelay(true);
  server.set_read_timeout(5);
  server.set_keep_alive_timeout(1);  // of an idle page: the program does not end before
  server.set_payload_max_length(1024);
  server.set_default_headers(
      {{"Cache-Control", "no-store"},
       {"X-Content-Type-Options", "nosniff"},
       {"Cross-Origin-Resource-Policy", "same-origin"},
       {"Referrer-Policy", "no-referrer"},
       {"Content-Security-Policy",
        "default-src 'none'; script-src 'unsafe-inline'; style-src 'unsafe-inline'; img-src 'self' data:; "
        "connect-src 'self'; base-uri 'none'; form-action 'none'; frame-ancestors 'none'"}});
  server.set_pre_routing_handler([&served](const Request& request, Response& response) {
    if (!is_own_host(request.get_header_value("Host"), served.port))
      response.status = 403;
    else if (request.method != "GET")
      response.status = 405;
    else
      return httplib::Server::HandlerResponse::Unhandled;
    return httplib::Server::HandlerResponse::Handled;
  });
  server.Get("/", [&served](const Request&, Response& response) {
    response.set_content(served.page, "text/html; charset=utf-8");
  });
  server.Get("/state", [&served](const Request& request, Response& response) {
    const std::lock_guard lock(served.mutex);
    const std::string version = std::to_string(served.version);
    if (request.get_param_value("after") == version) {
      response.status = 204;
      return;
    }
    response.set_content("{\"version\": " + version + ", \"state\": " + served.state + "}",
                         "application/json");
  });
  server.Get("/picture", [&served](const Request&, Response& response) {
    std::shared_ptr<const std::string> picture;
    {
      const std::lock_guard lock(served.mutex);
      picture = served.picture;
    }
    if (picture)
      response.set_content(*picture, type_of_picture(*picture));
    else
      response.status = 404;
  });
  if (port == 0)
    served.port = server.bind_to_any_port(kAddress);
  else
    served.port = server.bind_to_port(kAddress, port) ? port : -1;
  if (served.port <= 0)
    throw data::InputError("--port: found " + std::to_string(port) +
                           ", which another program listens on, expected a free one, or 0 for any");
  served.listening = std::thread([&server] { server.listen_after_bind(); });
}

WatchServer::~WatchServer() {
  // stop() before the thread listens would be lost.
  while (!served_->server.is_running()) std::this_thread::yield();
  served_->server.stop();
  served_->listening.join();
}

int WatchServer::port() const { return served_->port; }

void WatchServer::show(std::string state, std::shared_ptr<const std::string> picture) {
  const std::lock_guard lock(served_->mutex);
  ++served_->version;
  served_->state = std::move(state);
  served_->picture = std::move(picture);
}

}  // namespace flash
