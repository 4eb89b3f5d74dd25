// Tests of access rights, and of the requirements for a server on a public address.
#include "server/base/access.hpp"

#include <filesystem>
#include <fstream>

#include "server/base/server_error.hpp"
#include "tests/server/raw_connection.hpp"
#include "tests/server/served_room.hpp"
#include "tests/support/temporary_folder.hpp"

namespace enfilade::server::testing {
namespace {

const std::string kLooker = "looker-0123456789", kDriver = "driver-0123456789",
                  kAdmin = "keeper-0123456789";

Access makeThreeTokens() {
  Access access;
  access.tokens = {{Role::observe, kLooker}, {Role::drive, kDriver}, {Role::admin, kAdmin}};
  return access;
}

template <typename Action>
v1::ErrorCode catchCode(Action action) {
  try {
    action();
  } catch (const protocol::ProtocolError& error) {
    return error.code;
  }
  return v1::ERROR_UNSPECIFIED;
}

TEST(Access, WithoutTokensEveryoneIsAdmin) {
  EXPECT_EQ(findRole({}, ""), Role::admin);
}

TEST(Access, OnlyACompleteTokenIsAccepted) {
  const Access access = makeThreeTokens();
  EXPECT_EQ(findRole(access, kDriver), Role::drive);
  for (const std::string& wrong : {std::string(), kDriver.substr(1), kDriver + "0",
                                   std::string(kDriver.size(), 'x'), kDriver + kDriver}) {
    EXPECT_EQ(findRole(access, wrong), std::nullopt) << wrong;
  }
}

TEST(Access, BrowsersMayComeOnlyFromPagesThatAreKnown) {
  Access access;
  access.hosts = {"house.example.org"};
  access.origins = {"https://viewer.example.org"};
  EXPECT_FALSE(validateOrigin(access, "127.0.0.1:7878", ""));
  EXPECT_FALSE(validateOrigin(access, "[::1]:7878", ""));
  EXPECT_FALSE(validateOrigin(access, "localhost:7878", "http://localhost:7878"));
  EXPECT_FALSE(validateOrigin(access, "house.example.org", "https://viewer.example.org"));
  EXPECT_TRUE(validateOrigin(access, "", ""));
  EXPECT_TRUE(validateOrigin(access, "rebound.example.com:7878", ""));
  EXPECT_TRUE(validateOrigin(access, "localhost:7878", "http://localhost:3000"));
  EXPECT_TRUE(validateOrigin(access, "localhost:7878", "https://evil.example.com"));
  EXPECT_TRUE(validateOrigin(access, "localhost:7878", "null"));
}

TEST(Access, ATokenFileIsReadOrItsLineNamed) {
  const auto file = tests::makeOwnFile("tokens");
  const auto write = [&](const std::string& text) { std::ofstream(file) << text; };
  write("# observer\nobserve " + kLooker + "\n\nadmin " + kAdmin + "\n");
  EXPECT_EQ(readTokens(file).size(), 2u);
  for (const std::string& bad : {std::string(""), "observe\n" + kLooker, std::string("drive short"),
                                 "king " + kAdmin, "admin " + kAdmin + " more"}) {
    write(bad);
    EXPECT_THROW(readTokens(file), std::runtime_error) << bad;
  }
  std::filesystem::remove(file);
  EXPECT_THROW(readTokens(file), std::runtime_error);
}

class Roles : public ServedRoom {
 protected:
  void SetUp() override { serve({}, makeSmallRoom(), makeThreeTokens()); }
};

TEST_F(Roles, AWrongOrMissingTokenIsRefused) {
  EXPECT_EQ(catchCode([&] { makeClient("none"); }), v1::ERROR_UNAUTHENTICATED);
  EXPECT_EQ(catchCode([&] { makeClient("wrong", kAdmin + "x"); }), v1::ERROR_UNAUTHENTICATED);
  EXPECT_EQ(makeClient("right", kLooker).welcome().role(), v1::ROLE_OBSERVE);
}

TEST_F(Roles, EachRoleHasItsPermissions) {
  protocol::Client looker = makeClient("looker", kLooker), driver = makeClient("driver", kDriver);
  v1::ClientMessage restart;
  restart.mutable_restart();
  EXPECT_EQ(catchCode([&] { looker.step(); }), v1::ERROR_NOT_ALLOWED);
  EXPECT_EQ(looker.command(spawn("a", 0, 0, 0))->code(), v1::ERROR_NOT_ALLOWED);
  EXPECT_EQ(looker.metrics().ticks(), 0u);
  EXPECT_EQ(driver.step().tick(), 1u);
  EXPECT_EQ(catchCode([&] { looker.request(restart); }), v1::ERROR_NOT_ALLOWED);
  EXPECT_EQ(driver.request(restart).restart().tick(), 0u);
  protocol::Client admin = makeClient("admin", kAdmin);
  EXPECT_FALSE(admin.command(spawn("a", 0, 0, 0)));
  EXPECT_EQ(catchCode([&] { driver.request(restart); }), v1::ERROR_NOT_ALLOWED) << "admin's avatar";
}

TEST_F(Roles, TheAdminRestartsTheWorld) {
  protocol::Client admin = makeClient("admin", kAdmin);
  const std::uint64_t first = admin.step().state_hash();
  admin.command(spawn("a", 0, 0.01, 0));
  admin.step(10);
  v1::ClientMessage restart;
  restart.mutable_restart();
  EXPECT_EQ(admin.request(restart).restart().tick(), 0u);
  EXPECT_EQ(admin.step().state_hash(), first);
}

TEST_F(Roles, PagesWantATokenTooButHealthDoesNot) {
  const auto get = [&](const std::string& target, const std::string& more = "") {
    RawConnection raw(server_->port());
    raw.send("GET " + target + " HTTP/1.1\r\nHost: localhost\r\n" + more + "\r\n");
    return raw.readText().substr(0, 12);
  };
  EXPECT_EQ(get("/metrics"), "HTTP/1.1 401");
  EXPECT_EQ(get("/metrics?token=" + kLooker), "HTTP/1.1 200");
  EXPECT_EQ(get("/metrics", "Authorization: Bearer " + kLooker + "\r\n"), "HTTP/1.1 200");
  EXPECT_EQ(get("/healthz"), "HTTP/1.1 200");
  // The list of worlds is given only to clients with the right to see it.
  EXPECT_EQ(get("/healthz?world=main"), "HTTP/1.1 401");
  EXPECT_EQ(get("/healthz?world=nowhere"), "HTTP/1.1 401");
  EXPECT_EQ(get("/healthz?world=main&token=" + kLooker), "HTTP/1.1 200");
}

TEST(Listening, APublicAddressRequiresATokenAndInsecure) {
  const HostPort everywhere{"0.0.0.0", 0};
  Access access;
  EXPECT_THROW(Server(makeSmallRoom(), everywhere), ServerError);
  access.insecure = true;
  EXPECT_THROW(Server(makeSmallRoom(), everywhere, {{}, {}, access, {}, {}}), ServerError);
  access = makeThreeTokens();
  EXPECT_THROW(Server(makeSmallRoom(), everywhere, {{}, {}, access, {}, {}}), ServerError);
  access.insecure = true;
  EXPECT_GT(Server(makeSmallRoom(), everywhere, {{}, {}, access, {}, {}}).port(), 0);
}

}  // namespace
}  // namespace enfilade::server::testing
