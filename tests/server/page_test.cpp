// Tests of the files over HTTP: the scene as GLB, and the web page.
#include <zlib.h>

#include <filesystem>
#include <fstream>

#include "server/net/http_file.hpp"
#include "server/net/page_files.hpp"
#include "tests/server/body_room.hpp"
#include "tests/server/glb_reader.hpp"
#include "tests/server/raw_connection.hpp"
#include "tests/server/served_room.hpp"
#include "tests/support/temporary_folder.hpp"

namespace enfilade::server::testing {
namespace {

namespace fs = std::filesystem;

std::string unpackGzip(const std::string& packed) {
  z_stream stream{};
  EXPECT_EQ(inflateInit2(&stream, 15 + 16), Z_OK);
  std::string text(std::size_t{1} << 24, '\0');
  stream.next_in = reinterpret_cast<Bytef*>(const_cast<char*>(packed.data()));
  stream.avail_in = static_cast<uInt>(packed.size());
  stream.next_out = reinterpret_cast<Bytef*>(text.data());
  stream.avail_out = static_cast<uInt>(text.size());
  EXPECT_EQ(inflate(&stream, Z_FINISH), Z_STREAM_END);
  text.resize(stream.total_out);
  inflateEnd(&stream);
  return text;
}

struct Response {
  std::string head, body;
  std::string getStatus() const { return head.substr(9, 3); }
  /// The value of a header, or "".
  std::string findHeader(const std::string& name) const {
    const std::size_t at = head.find("\r\n" + name + ": ");
    if (at == std::string::npos) return "";
    const std::size_t start = at + name.size() + 4;
    return head.substr(start, head.find("\r\n", start) - start);
  }
};

class Page : public ServedRoom {
 protected:
  void SetUp() override {
    fs::create_directories(folder_ / "page" / "assets");
    write("page/index.html", "<!doctype html><title>Enfilade</title>");
    write("page/app.js", "export const one = 1;\n");
    write("page/assets/a%20b.wasm", std::string("\0asm", 4));
    write("secret.txt", "HIDDEN-42");
    fs::create_symlink(folder_ / "secret.txt", folder_ / "page" / "linked.txt");
  }
  void write(const std::string& name, const std::string& text) {
    std::ofstream(folder_ / name, std::ios::binary) << text;
  }
  void servePage(Access access = {}, bool withPage = true) {
    ServerOptions options;
    options.access = std::move(access);
    options.additionalScenes = {makeBodyRoom()};
    if (withPage) options.pageFolder = folder_ / "page";
    server_ =
        std::make_unique<Server>(makeSmallRoom(), HostPort{"127.0.0.1", 0}, std::move(options));
  }
  Response get(const std::string& target, const std::string& headers = "") {
    RawConnection raw(server_->port());
    raw.send("GET " + target + " HTTP/1.1\r\nHost: localhost\r\n" + headers + "\r\n");
    const std::string text = raw.readText();
    const std::size_t end = text.find("\r\n\r\n");
    return {text.substr(0, end + 2), text.substr(std::min(end + 4, text.size()))};
  }

  const tests::TemporaryFolder own_;
  const fs::path folder_ = own_.getPath();
};

TEST_F(Page, TheSceneIsServedAsGlb) {
  servePage();
  const Response response = get("/scene.glb");
  EXPECT_EQ(response.getStatus(), "200");
  EXPECT_EQ(response.findHeader("Content-Type"), "model/gltf-binary");
  EXPECT_EQ(response.findHeader("Content-Length"), std::to_string(response.body.size()));
  EXPECT_EQ(response.findHeader("Content-Encoding"), "");
  EXPECT_EQ(response.findHeader("X-Content-Type-Options"), "nosniff");
  const GlbReader file(response.body);
  EXPECT_EQ(file.collectDrawnTriangles().size(), 36u);
  EXPECT_EQ(file.json.at("scenes").at(0).at("extras").at("entities").at(1).at("path"), "room_wall");
  const std::string hash = file.json.at("scenes").at(0).at("extras").at("sceneHash");
  EXPECT_EQ(response.findHeader("ETag").substr(0, 18), "\"" + hash + "-");
}

TEST_F(Page, AnUnchangedSceneIsNotSentAgain) {
  servePage();
  const std::string tag = get("/scene.glb").findHeader("ETag");
  const Response again = get("/scene.glb", "If-None-Match: \"other\", " + tag + "\r\n");
  EXPECT_EQ(again.getStatus(), "304");
  EXPECT_EQ(again.body, "");
  EXPECT_EQ(again.findHeader("ETag"), tag);
  EXPECT_EQ(get("/scene.glb", "If-None-Match: \"other\"\r\n").getStatus(), "200");
}

TEST_F(Page, TheSceneIsCompressedForClientsThatAcceptIt) {
  servePage();
  const Response plain = get("/scene.glb");
  const Response packed = get("/scene.glb", "Accept-Encoding: br, gzip;q=0.8\r\n");
  EXPECT_EQ(packed.findHeader("Content-Encoding"), "gzip");
  EXPECT_EQ(packed.findHeader("Vary"), "Accept-Encoding");
  EXPECT_LT(packed.body.size(), plain.body.size());
  EXPECT_EQ(unpackGzip(packed.body), plain.body);
}

TEST_F(Page, EachWorldHasItsScene) {
  servePage();
  const Response other = get("/scene.glb?world=body_room");
  EXPECT_EQ(other.getStatus(), "200");
  EXPECT_NE(other.body.find("\"body\":\"door\""), std::string::npos);
  EXPECT_EQ(get("/scene.glb?world=nowhere").getStatus(), "404");
}

TEST_F(Page, SimultaneousRequestsShareTheFile) {
  servePage();
  std::vector<std::unique_ptr<RawConnection>> clients;
  for (int i = 0; i < 8; ++i) {
    clients.push_back(std::make_unique<RawConnection>(server_->port()));
    clients.back()->send("GET /scene.glb HTTP/1.1\r\nHost: localhost\r\n\r\n");
  }
  clients.pop_back();  // leaves before the answer
  const std::string first = clients.front()->readText();
  EXPECT_NE(first.find("glTF"), std::string::npos);
  for (std::size_t i = 1; i < clients.size(); ++i) EXPECT_EQ(clients[i]->readText(), first);
}

TEST_F(Page, TheSceneNeedsATokenButThePageDoesNot) {
  Access access;
  access.tokens = {{Role::observe, "look"}};
  servePage(access);
  EXPECT_EQ(get("/scene.glb").getStatus(), "401");
  EXPECT_EQ(get("/scene.glb?token=look").getStatus(), "200");
  EXPECT_EQ(get("/scene.glb", "Authorization: Bearer look\r\n").getStatus(), "200");
  EXPECT_EQ(get("/").getStatus(), "200");
  EXPECT_EQ(get("/page/app.js").getStatus(), "200");
  EXPECT_EQ(get("/", "Origin: https://evil.example.com\r\n").getStatus(), "403");
  EXPECT_EQ(get("/scene.glb?token=look", "Origin: https://evil.example.com\r\n").getStatus(),
            "403");
}

TEST_F(Page, ItsFilesHaveTypesAndASecurityPolicy) {
  servePage();
  const Response index = get("/");
  EXPECT_EQ(index.getStatus(), "200");
  EXPECT_EQ(index.body, "<!doctype html><title>Enfilade</title>");
  EXPECT_EQ(index.findHeader("Content-Type"), "text/html; charset=utf-8");
  EXPECT_EQ(index.findHeader("Cache-Control"), "no-cache");
  EXPECT_EQ(index.findHeader("Referrer-Policy"), "no-referrer");
  EXPECT_EQ(index.findHeader("X-Content-Type-Options"), "nosniff");
  EXPECT_EQ(index.findHeader("Content-Security-Policy"),
            "default-src 'self'; img-src 'self' blob: data:; style-src 'self' 'unsafe-inline'; "
            "worker-src 'self' blob:; connect-src 'self' ws: wss: blob: data:; "
            "script-src 'self' 'wasm-unsafe-eval'");
  EXPECT_EQ(get("/?world=main#x").body, index.body);
  EXPECT_EQ(get("/page/index.html").body, index.body);
  EXPECT_EQ(get("/page/app.js").findHeader("Content-Type"), "text/javascript; charset=utf-8");
  const Response wasm = get("/page/assets/a%2520b.wasm");
  EXPECT_EQ(wasm.findHeader("Content-Type"), "application/wasm");
  EXPECT_EQ(wasm.body, std::string("\0asm", 4));
  EXPECT_EQ(get("/", "If-None-Match: " + index.findHeader("ETag") + "\r\n").getStatus(), "304");
  EXPECT_NE(index.findHeader("ETag"), get("/page/app.js").findHeader("ETag"));
}

TEST_F(Page, NoPathLeadsOutOfItsFolder) {
  servePage();
  for (const char* target :
       {"/page/../secret.txt", "/page/%2e%2e/secret.txt", "/page/%2e%2e%2fsecret.txt",
        "/page/..%5csecret.txt", "/page//etc/passwd", "/page/./app.js", "/page/assets", "/page/",
        "/page/linked.txt", "/page/app.js%00.html", "/page/assets/../../secret.txt"}) {
    const Response response = get(target);
    EXPECT_EQ(response.getStatus(), "404") << target;
    EXPECT_EQ(response.body.find("HIDDEN-42"), std::string::npos) << target;
  }
  EXPECT_EQ(get("/secret.txt").getStatus(), "404");
}

TEST_F(Page, WithoutAFolderTheAnswerSaysHowToBuildIt) {
  servePage({}, false);
  const Response response = get("/");
  EXPECT_EQ(response.getStatus(), "404");
  EXPECT_NE(response.body.find("./dev build"), std::string::npos);
  EXPECT_EQ(get("/page/app.js").getStatus(), "404");
  EXPECT_EQ(get("/scene.glb").getStatus(), "200");
}

TEST_F(Page, TheWebSocketIsStillAtTheRoot) {
  servePage();
  RawConnection raw(server_->port());
  raw.send(
      "GET / HTTP/1.1\r\nHost: localhost\r\nUpgrade: websocket\r\nConnection: Upgrade\r\n"
      "Sec-WebSocket-Version: 13\r\nSec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==\r\n\r\n");
  EXPECT_EQ(raw.readText("\r\n\r\n").substr(0, 12), "HTTP/1.1 101");
}

TEST(HttpFile, TagsAreComparedAsInRfc9110) {
  EXPECT_TRUE(matchesTag("\"a\"", "a"));
  EXPECT_TRUE(matchesTag("W/\"a\"", "a"));
  EXPECT_TRUE(matchesTag(" \"b\" ,\t\"a\"", "a"));
  EXPECT_TRUE(matchesTag("*", "a"));
  EXPECT_FALSE(matchesTag("", "a"));
  EXPECT_FALSE(matchesTag("a", "a")) << "not quoted";
  EXPECT_FALSE(matchesTag("\"ab\"", "a"));
  EXPECT_FALSE(matchesTag("\"", "")) << "one quote is no tag";
}

TEST(HttpFile, AcceptEncodingIsRead) {
  EXPECT_TRUE(acceptsGzip("gzip"));
  EXPECT_TRUE(acceptsGzip("deflate, gzip, br"));
  EXPECT_TRUE(acceptsGzip("gzip; q=0.5"));
  EXPECT_FALSE(acceptsGzip("gzip;q=0"));
  EXPECT_FALSE(acceptsGzip("gzip;q=x"));
  EXPECT_FALSE(acceptsGzip("gzippo, br"));
  EXPECT_FALSE(acceptsGzip(""));
}

}  // namespace
}  // namespace enfilade::server::testing
