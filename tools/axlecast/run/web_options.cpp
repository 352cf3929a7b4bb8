#include "tools/axlecast/run/web_options.h"

#include <CLI/CLI.hpp>
#include <filesystem>

namespace axlecast {

void WebOptions::AddTo(CLI::App& command) {
  config.AddTo(command, ConfigOption::Form::kPositional);
  command.add_option("--log", logs, "Show these recorded logs instead of the live machine")->type_name("FILE");
  command.add_option("--bind", bind, "Address to serve on, instead of the file's (127.0.0.1: this host alone)")
      ->type_name("ADDRESS");
  command.add_option("--port", port, "TCP port, instead of the file's (8380); 0: any free one")
      ->check(CLI::Range(0, 65535))
      ->type_name("N");
  command.add_option("--tls-cert", certificate, "PEM file of the certificate and its chain")->type_name("FILE");
  command.add_option("--tls-key", key, "PEM file of its key, mode 0600 or 0640")->type_name("FILE");
  command.add_option("--token-file", token_file, "File of mode 0600 or 0640 that holds what browsers sign in with")
      ->type_name("FILE");
  command.add_option("--name", names, "A name under which browsers reach this host, besides its own")
      ->type_name("NAME");
  command.add_option("--clients", clients, "Browsers at the same time")
      ->check(CLI::Range(1, 200))
      ->capture_default_str()
      ->type_name("N");
}

WebConfig WebOptions::Over(WebConfig web) const {
  web.bind = bind.value_or(web.bind);
  web.port = port.value_or(web.port);
  web.certificate = certificate.value_or(web.certificate);
  web.key = key.value_or(web.key);
  if (token_file) web.token = SecretFileAt(*token_file);
  web.names.insert(web.names.end(), names.begin(), names.end());
  return web;
}

SecretPlace SecretFileAt(const std::string& file) {
  SecretPlace place;
  place.file = std::filesystem::absolute(file);
  place.group_may_read = true;
  return place;
}

}  // namespace axlecast
