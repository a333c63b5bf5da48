"""roscpp nodes from their source."""

from __future__ import annotations

import sys
import textwrap
import time
from pathlib import Path

import pytest
from ros_model.language.metamodel import Position
from ros_model_extraction.cpp.node_reader import Entry
from ros_model_extraction.io.cpp_files import read_cpp_node
from ros_model_extraction.node_facts import FoundParameter, NodeSource, SourceError

WORKER = """
    #pragma once
    #include <ros/ros.h>
    #define COMMANDS "cmd_vel"
    namespace demo {
    typedef actionlib::SimpleActionClient<move_base_msgs::MoveBaseAction> MoveClient;
    class Worker {
     public:
      Worker(ros::NodeHandle nh, ros::NodeHandle pnh, const std::string& prefix);
      void onScan(const sensor_msgs::LaserScan::ConstPtr& scan);
      bool onReset(std_srvs::Empty::Request& request, std_srvs::Empty::Response& response);
     private:
      ros::NodeHandle nh_, pnh_;
      MoveClient client_;
      std::string topic_, other_;
      tf2_ros::TransformBroadcaster broadcaster_;
      actionlib::SimpleActionServer<demo_msgs::DockAction> server_;
    };
    }
    """
WORKER_CODE = """
    #include "demo/worker.h"
    namespace demo {
    Worker::Worker(ros::NodeHandle nh, ros::NodeHandle pnh, const std::string& prefix)
        : nh_(nh), pnh_(pnh), client_("move_base", true),
          server_(pnh_, "dock", boost::bind(&Worker::onDock, this, _1), false) {
      pnh_.param<std::string>("scan_topic", topic_, "front/scan");
      pnh_.getParam("other_topic", other_);
      double rate = pnh.param("rate", 10.0);
      auto a = nh_.advertise<geometry_msgs::Twist>(COMMANDS, 1);
      auto b = pnh_.advertise<std_msgs::String>(prefix + "/state", 1, true);
      auto c = nh_.subscribe(topic_, 1, &Worker::onScan, this);
      auto d = nh_.subscribe<std_msgs::Int32>(other_, 1, boost::bind(&Worker::onOther, this, _1));
      auto e = pnh_.advertiseService("reset", &Worker::onReset, this);
      auto f = nh_.serviceClient<nav_msgs::GetMap>("static_map");
    }
    }
    """
MAIN = """
    #include "demo/worker.h"
    static const std::string kName = "worker";
    int main(int argc, char** argv) {
      ros::init(argc, argv, kName);
      ros::NodeHandle nh;
      ros::NodeHandle pnh("~");
      demo::Worker worker(nh, pnh, "arm");
    }
    """


@pytest.fixture
def node(tmp_path: Path):
    """Makes a source file of the code, with a main around it, and reads it."""

    def make(code: str, before: str = "", values=None) -> NodeSource:
        (tmp_path / "main.cpp").write_text(
            f"#include <ros/ros.h>\n{textwrap.dedent(before)}\nint main(int argc, char** argv) {{\n"
            f'ros::NodeHandle nh;\nros::NodeHandle pnh("~");\n{textwrap.dedent(code)}\n}}\n'
        )
        return read_cpp_node([tmp_path / "main.cpp"], tmp_path, values)

    return make


def found(node: NodeSource) -> set[tuple[str, str, str]]:
    return {(port.kind.value, port.name, port.type) for port in node.ports}


def remarks(node: NodeSource) -> str:
    return "\n".join(map(str, node.remarks))


def test_node_of_several_files_is_followed_through_its_class(tmp_path):
    (tmp_path / "src").mkdir()
    (tmp_path / "include" / "demo").mkdir(parents=True)
    (tmp_path / "include" / "demo" / "worker.h").write_text(textwrap.dedent(WORKER))
    sources = [tmp_path / "src" / "main.cpp", tmp_path / "src" / "worker.cpp"]
    for path, code in zip(sources, (MAIN, WORKER_CODE), strict=True):
        path.write_text(textwrap.dedent(code))
    node = read_cpp_node(sources, tmp_path)
    assert node.name == "worker"
    assert found(node) == {
        ("action client", "move_base", "move_base_msgs/MoveBaseAction"),
        ("action server", "~dock", "demo_msgs/DockAction"),
        ("publisher", "cmd_vel", "geometry_msgs/Twist"),
        ("publisher", "~arm/state", "std_msgs/String"),
        ("subscriber", "front/scan", "sensor_msgs/LaserScan"),
        ("subscriber", "{other_}@src/worker.cpp:13", "std_msgs/Int32"),
        ("service server", "~reset", "std_srvs/Empty"),
        ("service client", "static_map", "nav_msgs/GetMap"),
        ("publisher", "/tf", "tf2_msgs/TFMessage"),
    }
    assert {(p.name, p.default) for p in node.parameters} == {
        ("~scan_topic", "front/scan"),
        ("~other_topic", None),
        ("~rate", 10.0),
    }
    assert 'subscriber front/scan: the default of the parameter "scan_topic"' in remarks(node)
    assert "src/worker.cpp:13:12: subscriber: its name is not known: {other_}" in remarks(node)


@pytest.mark.parametrize(
    ("code", "expected"),
    [
        ('nh.advertise<std_msgs::String>("x", 1);', ("publisher", "x", "std_msgs/String")),
        ('pnh.advertise<std_msgs::String>("x", 1);', ("publisher", "~x", "std_msgs/String")),
        ('pnh.advertise<std_msgs::String>("/x", 1);', ("publisher", "/x", "std_msgs/String")),
        ('ros::NodeHandle a("arm"); a.advertise<std_msgs::String>("x", 1);', ("publisher", "arm/x", "std_msgs/String")),
        (
            'ros::NodeHandle a(pnh, "arm"); a.advertise<std_msgs::String>("x", 1);',
            ("publisher", "~arm/x", "std_msgs/String"),
        ),
        (
            'auto a = std::make_shared<ros::NodeHandle>("~"); a->advertise<std_msgs::String>("x", 1);',
            ("publisher", "~x", "std_msgs/String"),
        ),
        ('std::string t = "x"; nh.advertise<std_msgs::String>(t + "/y", 1);', ("publisher", "x/y", "std_msgs/String")),
        ('nh.advertise<std_msgs::String>("x" "/y", 1);', ("publisher", "x/y", "std_msgs/String")),
        ("nh.advertise<std_msgs::String>(TOPIC, 1);", ("publisher", "macro", "std_msgs/String")),
        ("nh.advertise<std_msgs::String>(demo::kTopic, 1);", ("publisher", "constant", "std_msgs/String")),
        ("nh.advertise<std_msgs::String>(name(), 1);", ("publisher", "returned", "std_msgs/String")),
        (
            'nh.advertise<std_msgs::String>(ros::this_node::getName() + "/x", 1);',
            ("publisher", "~x", "std_msgs/String"),
        ),
        ('nh.subscribe("x", 1, onString);', ("subscriber", "x", "std_msgs/String")),
        ('nh.subscribe("x", 1, boost::bind(&onString, _1));', ("subscriber", "x", "std_msgs/String")),
        (
            'nh.subscribe<std_msgs::Int32>("x", 1, [](const auto& m) {});',
            ("subscriber", "x", "std_msgs/Int32"),
        ),
        (
            'nh.subscribe("x", 1, +[](const nav_msgs::OdometryConstPtr& m) {});',
            ("subscriber", "x", "nav_msgs/Odometry"),
        ),
        ('ros::topic::waitForMessage<std_msgs::String>("x");', ("subscriber", "x", "std_msgs/String")),
        (
            'message_filters::Subscriber<sensor_msgs::Image> s(nh, "x", 1);',
            ("subscriber", "x", "sensor_msgs/Image"),
        ),
        (
            'actionlib::SimpleActionClient<move_base_msgs::MoveBaseAction> c("x", true);',
            ("action client", "x", "move_base_msgs/MoveBaseAction"),
        ),
        (
            'image_transport::ImageTransport it(nh); image_transport::Publisher p = it.advertise("x", 1);',
            ("publisher", "x", "sensor_msgs/Image"),
        ),
        (
            "std::unique_ptr<image_transport::ImageTransport> it; it.reset(new image_transport::ImageTransport(pnh)); "
            'it->advertise("x", 1);',
            ("publisher", "~x", "sensor_msgs/Image"),
        ),
        (
            "dynamic_reconfigure::Server<demo::DemoConfig> s;",
            ("service server", "~set_parameters", "dynamic_reconfigure/Reconfigure"),
        ),
        (
            'std_srvs::Empty e; ros::service::waitForService("x"); ros::service::call("/x", e);',
            ("service client", "/x", "std_srvs/Empty"),
        ),
        ('ros::service::createClient<std_srvs::Empty>("x");', ("service client", "x", "std_srvs/Empty")),
        (
            'auto o = ros::AdvertiseOptions::create<std_msgs::String>("x", 1, 0, 0, ros::VoidPtr(), 0); '
            "pnh.advertise(o);",
            ("publisher", "~x", "std_msgs/String"),
        ),
        (
            'ros::SubscribeOptions o; o = ros::SubscribeOptions::create<std_msgs::String>("x", 1, f);pnh.subscribe(o);',
            ("subscriber", "~x", "std_msgs/String"),
        ),
        (
            'pnh.advertiseService(ros::AdvertiseServiceOptions::create<std_srvs::Empty>("x", f, ros::VoidPtr(), 0));',
            ("service server", "~x", "std_srvs/Empty"),
        ),
        ("tf::TransformListener l;", ("subscriber", "/tf", "tf2_msgs/TFMessage")),
    ],
)
def test_interfaces_are_found(node, code, expected):
    before = """
        #define TOPIC "macro"
        namespace demo { constexpr char kTopic[] = "constant"; }
        std::string name() { return "returned"; }
        void onString(const std_msgs::String& message) {}
        """
    assert expected in found(node(code, before))


def test_what_is_not_known_is_marked_with_its_place(node):
    result = node("nh.advertise<std_msgs::String>(argv[1], 1);\nnh.subscribe(other(), 1, callback);")
    assert found(result) == {
        ("publisher", "{argv[1]}@main.cpp:6", "std_msgs/String"),
        ("subscriber", "{other()}@main.cpp:7", ""),
    }
    assert "main.cpp:7:1: subscriber: its type is not known" in remarks(result)


def test_handle_that_is_handed_in_has_the_namespaces_of_all_callers(node):
    before = 'void make(ros::NodeHandle& h) { h.advertise<std_msgs::String>("x", 1); }'
    assert found(node("make(nh); make(pnh);", before)) == {
        ("publisher", "x", "std_msgs/String"),
        ("publisher", "~x", "std_msgs/String"),
    }


@pytest.mark.parametrize(
    ("worker", "making"),
    [
        ('Worker() : pnh_("~") { USE } int rate_; ros::NodeHandle pnh_;', "Worker w;"),
        ('Worker() : rate_(1), pnh_("~") { USE } int rate_; ros::NodeHandle nh_, pnh_;', "Worker w;"),
        ('Worker() : pnh_{"~"} { USE } ros::NodeHandle pnh_{"other"};', "Worker w;"),
        ('Worker() { pnh_ = ros::NodeHandle("~"); USE } ros::NodeHandle pnh_;', "Worker w;"),
        ("Worker(ros::NodeHandle n, ros::NodeHandle p) : pnh_(p) { USE } ros::NodeHandle pnh_;", "Worker w(nh, pnh);"),
        ("Worker(ros::NodeHandle p) : pnh_(p) { USE } ros::NodeHandle pnh_;", "auto w = new Worker(pnh);"),
    ],
    ids=["above", "second of several", "default member", "assigned", "passed", "passed to new"],
)
def test_inline_constructor_above_its_members_makes_them(node, worker, making):
    use = 'pub_ = pnh_.advertise<std_msgs::String>("a", 1);'
    result = node(making, f"class Worker {{ public: {worker.replace('USE', use)} ros::Publisher pub_; }};")
    assert ("publisher", "~a", "std_msgs/String") in found(result)
    assert ("publisher", "a", "std_msgs/String") not in found(result)


@pytest.mark.parametrize(
    "code",
    [
        'std::unique_ptr<ros::NodeHandle> q; q.reset(new ros::NodeHandle("~x"));',
        'std::unique_ptr<ros::NodeHandle> q(new ros::NodeHandle("~x"));',
        'std::unique_ptr<ros::NodeHandle> q = nullptr; q = std::make_unique<ros::NodeHandle>("~x");',
        'ros::NodeHandlePtr q; q = boost::make_shared<ros::NodeHandle>(pnh, "x");',
        'ros::NodeHandlePtr q = ros::NodeHandlePtr(new ros::NodeHandle("~x"));',
        'ros::NodeHandle* q; q = new ros::NodeHandle("~x");',
        'ros::NodeHandle x("~x"); ros::NodeHandle* q = &x;',
        'auto x = std::make_unique<ros::NodeHandle>("~x"); std::unique_ptr<ros::NodeHandle> q = std::move(x);',
    ],
)
def test_handle_behind_a_pointer_is_what_the_pointer_is_given(node, code):
    assert found(node(code + 'q->advertise<std_msgs::String>("b", 1);')) == {("publisher", "~x/b", "std_msgs/String")}


def test_pointers_that_are_members_or_global_are_followed_too(node):
    before = """
        std::shared_ptr<ros::NodeHandle> global;
        class Worker {
         public:
          Worker() { inner_.reset(new ros::NodeHandle("~x")); inner_->advertise<std_msgs::String>("member", 1); }
          std::unique_ptr<ros::NodeHandle> inner_;
        };
        """
    code = 'Worker worker; global.reset(new ros::NodeHandle("~y")); global->advertise<std_msgs::String>("global", 1);'
    assert {name for _, name, _ in found(node(code, before))} == {"~x/member", "~y/global"}


@pytest.mark.parametrize(
    "code",
    [
        "ros::NodeHandle* q; fill(q);",
        "std::unique_ptr<ros::NodeHandle> q;",
        "std::unique_ptr<ros::NodeHandle> q = nullptr; fill(q);",
        "ros::NodeHandlePtr q = made();",
        "std::unique_ptr<ros::NodeHandle> q; q.reset(made());",
        "ros::NodeHandle* q = new ros::NodeHandle(nh, name());",
        "std::optional<ros::NodeHandle> q; fill(q);",
        "typedef std::shared_ptr<ros::NodeHandle> Handle; Handle q;",
    ],
)
def test_handle_whose_construction_is_not_known_is_never_the_root(node, code):
    result = node(code + 'q->advertise<std_msgs::String>("b", 1);')
    assert [(port.is_resolved, "b@main.cpp:6" in port.name) for port in result.ports] == [(False, True)]
    assert "publisher: its name is not known" in remarks(result)


def test_options_that_are_made_elsewhere_are_marked(node):
    result = node('nh.advertise(options);\nros::service::call(name, request); ros::service::waitForService("/y");')
    assert found(result) == {
        ("publisher", "{options}@main.cpp:6", ""),
        ("service client", "{name}@main.cpp:7", ""),
    }


def test_parameters_come_with_defaults(node):
    result = node(
        """
        int depth; double rate; std::string frame;
        nh.param("depth", depth, 3);
        pnh.param<std::string>("frame", frame, "map");
        pnh.getParam("rate", rate);
        ros::param::get("~private", depth);
        ros::param::get("/global", depth);
        bool fast = pnh.param("fast", true);
        """
    )
    assert {(p.name, p.default) for p in result.parameters} == {
        ("depth", 3),
        ("~frame", "map"),
        ("~rate", None),
        ("~private", None),
        ("/global", None),
        ("~fast", True),
    }


def test_given_parameter_decides_a_name(node):
    values = {"~topic": "given"}
    code = 'std::string t; pnh.param<std::string>("topic", t, "default"); nh.advertise<std_msgs::String>(t, 1);'
    assert found(node(code, values=values.__getitem__)) == {("publisher", "given", "std_msgs/String")}


def test_part_that_does_not_parse_is_told_and_the_rest_read(node):
    before = 'int broken(;\nvoid f() { @ pnh.advertise<std_msgs::String>("y", 1) @@ x; }\n'
    result = node('nh.advertise<std_msgs::String>("x", 1);', before=before)
    assert ("publisher", "x", "std_msgs/String") in found(result)
    assert "main.cpp:3:" in remarks(result) and "can't be parsed" in remarks(result)
    assert "main.cpp:2:" not in remarks(result), "what can't be about ROS is nothing to act upon"


def test_classes_that_are_loaded_by_name_are_told_of(node):
    result = node('pluginlib::ClassLoader<Base> loader("demo", "demo::Base");')
    assert "of the classes that pluginlib::ClassLoader loads, only those of this package count" in remarks(result)


@pytest.mark.parametrize(
    "content", [b"\0binary", b"int = 3; int *; class { int; };", b"{" * 200_000, b"\xff\xfe", b"f(" * 50_000, b""]
)
def test_bad_sources_neither_hang_nor_crash(tmp_path, content):
    path = tmp_path / "bad.cpp"
    path.write_bytes(content)
    try:
        assert read_cpp_node([path], tmp_path).ports == ()
    except SourceError as error:
        assert "bad.cpp:1:1: not read" in str(error)


def test_variables_that_name_each_other_end(node):
    result = node("std::string a = b; std::string b = a; nh.advertise<std_msgs::String>(a, 1);")
    assert [port.is_resolved for port in result.ports] == [False]


LIBRARY = """
    #include <stereo_msgs/DisparityImage.h>
    class Base { public: virtual void setUp() = 0; };
    class Used : public Base {
     public:
      explicit Used(ros::NodeHandle& nh) : nh_(nh) {}
      Used(int seed, int duration) {}
      void setUp() override { nh_.advertise<std_msgs::String>("virtual", 1); }
      void helped() { help(nh_); }
      void never() { nh_.advertise<std_msgs::String>("never", 1); }
      static void help(ros::NodeHandle& nh) { nh.advertise<std_msgs::String>("helped", 1); }
      ros::NodeHandle nh_;
      static int count;
    };
    int Used::count = 0;
    class Unused {
     public:
      Unused() { nh_.subscribe<std_msgs::String>("unused", 1, nullptr); }
      static int count;
      tf2_ros::TransformBroadcaster broadcaster_;
      ros::NodeHandle nh_;
    };
    int Unused::count = 0;
    void unused_function(ros::NodeHandle nh) { nh.advertise<std_msgs::String>("unused_function", 1); }
    """


def test_only_what_main_can_reach_counts(node):
    assert {name for _, name, _ in found(node("Used used(nh); used.helped();", LIBRARY))} == {"virtual", "helped"}


def test_class_within_a_function_is_part_of_it(node):
    code = 'struct Own { void go(ros::NodeHandle n) { n.advertise<std_msgs::String>("x", 1); } }; Own().go(nh);'
    assert found(node(code)) == {("publisher", "x", "std_msgs/String")}


def test_class_that_is_named_in_a_text_may_be_loaded(node):
    assert {name for _, name, _ in found(node('load("demo/Unused");', LIBRARY))} == {"unused", "/tf"}


def test_sources_without_a_main_count_as_a_whole(tmp_path):
    (tmp_path / "library.cpp").write_text(textwrap.dedent(LIBRARY))
    ports = read_cpp_node([tmp_path / "library.cpp"], tmp_path).ports
    names = {port.name.removeprefix("{nh}/").partition("@")[0] for port in ports}
    assert names == {"virtual", "helped", "never", "unused", "/tf", "unused_function"}


def test_constructor_that_no_call_fits_makes_nothing(node):
    before = """
        class Mapper {
         public:
          Mapper() : private_nh_("~") { init(); }
          Mapper(ros::NodeHandle& nh, ros::NodeHandle& pnh) : node_(nh), private_nh_(pnh) { init(); }
          Mapper(unsigned seed, unsigned duration) : seed_(seed) { init(); }
          void init() { private_nh_.getParam("rate", rate_); node_.advertise<nav_msgs::OccupancyGrid>("map", 1); }
          ros::NodeHandle node_, private_nh_;
        };
        """
    mapped = node("Mapper mapper;", before)
    assert found(mapped) == {("publisher", "map", "nav_msgs/OccupancyGrid")}
    assert {parameter.name for parameter in mapped.parameters} == {"~rate"}


def test_name_that_is_only_passed_on_by_code_that_nobody_calls_is_left_out(node):
    before = """
        class Planner {
         public:
          Planner(std::string name, int* map) { initialize(name, map, "map"); }
          Planner(std::string name, int* map, std::string frame) { initialize(name, map, frame); }
          void initialize(std::string name, int* map, std::string frame) {
            ros::NodeHandle pnh("~/" + name);
            pnh.advertise<nav_msgs::Path>("plan", 1);
          }
          void initialize(std::string name, Costmap* costmap) { initialize(name, costmap->map(), costmap->frame()); }
        };
        class Derived : public Planner {
         public:
          Derived(std::string name, Costmap* costmap) : Planner(name, costmap->map()) {}
        };
        """
    assert found(node('Derived derived("planner", &costmap);', before)) == {
        ("publisher", "~planner/plan", "nav_msgs/Path")
    }


@pytest.mark.parametrize(
    ("code", "expected"),
    [
        ('nh.advertise < std_msgs::String > ("x", 1);', ("publisher", "x", "std_msgs/String")),
        (
            'ros::Subscriber s = nh.subscribe < std_msgs::String\n > ("x", 1, f);',
            ("subscriber", "x", "std_msgs/String"),
        ),
        ('nh.advertise<DisparityImage>("x", 1);', ("publisher", "x", "stereo_msgs/DisparityImage")),
        ("Named named(ros::this_node::getName());", ("publisher", "~", "std_msgs/String")),
        (
            'image_transport::ImageTransport it(nh); image_transport::SubscriberFilter f; f.subscribe(it, "x", 1);',
            ("subscriber", "x", "sensor_msgs/Image"),
        ),
        ('nh.advertise<std_msgs::String>(ros::names::clean("x"), 1);', ("publisher", "x", "std_msgs/String")),
    ],
)
def test_ways_of_writing_that_public_packages_have(node, code, expected):
    before = """
        #include <stereo_msgs/DisparityImage.h>
        struct Named { Named(std::string name) { nh_.advertise<std_msgs::String>(name, 1); } ros::NodeHandle nh_; };
        """
    assert found(node(code, before)) == {expected}


def test_type_without_its_package_that_two_packages_have_is_not_known(node):
    before = "#include <std_msgs/Level.h>\n#include <demo_msgs/Level.h>"
    assert found(node('nh.advertise<Level>("x", 1);', before)) == {("publisher", "x", "")}


def test_reconfigure_server_is_no_callback_and_no_null(node):
    before = """
        class Worker {
         public:
          Worker() : server_(NULL) {
            server_ = new dynamic_reconfigure::Server<demo::DemoConfig>(ros::NodeHandle("~/inner"));
            dynamic_reconfigure::Server<demo::DemoConfig>::CallbackType f = boost::bind(&Worker::on, this, _1, _2);
            server_->setCallback(f);
          }
          dynamic_reconfigure::Server<demo::DemoConfig>* server_;
        };
        """
    assert {name for _, name, _ in found(node("Worker worker;", before))} == {
        "~inner/set_parameters",
        "~inner/parameter_descriptions",
        "~inner/parameter_updates",
    }


def test_line_with_several_unknown_names_is_one_interface(node):
    before = (
        'void make(ros::NodeHandle nh, std::string n) { ros::NodeHandle a(n); a.advertise<std_msgs::String>("x", 1); }'
    )
    made = node('make(nh, one()); make(nh, two()); make(nh, "three");', before).declared()
    assert [port.name.partition("@")[0] for port in made.ports] == ["{one()}/x", "three/x"]


@pytest.mark.parametrize(
    ("code", "kind", "default"),
    [
        ('double x; pnh.param("x", x, 5.0);', "Double", 5.0),
        ('double x; pnh.param<double>("x", x, 5);', "Double", 5.0),
        ('int x; pnh.param("x", x, 5);', "Integer", 5),
        ('unsigned int x; pnh.getParam("x", x);', "Integer", None),
        ('float x; pnh.getParam("x", x);', "Double", None),
        ('std::string x; pnh.getParam("x", x);', "String", None),
        ('bool x; if (!pnh.getParam("x", x)) x = true;', "Boolean", True),
        ('double x; if (!pnh.getParam("x", x)) { ROS_INFO("none"); x = 1; }', "Double", 1.0),
        ('double x, y; if (!pnh.getParam("x", x)) y = 1;', "Double", None),
        ('double x; if (pnh.getParam("x", x)) x = 1;', "Double", None),
        ('double x; pnh.param("x", x, 2 * (1 + 0.5));', "Double", 3.0),
        ('int x; pnh.param("x", x, 7 / 2);', "Integer", 3),
        ('int x; pnh.param("x", x, 7 / 0);', "Integer", None),
        ('double x; pnh.param("x", x, some());', "Double", None),
        ('XmlRpc::XmlRpcValue x; pnh.getParam("x", x);', None, None),
        (f'double x; pnh.param("x", x, {"(" * 3000}1.0{")" * 3000});', "Double", None),
        (f'double x; pnh.param("x", x, 1.0 + 1{"0" * 400});', "Double", None),
    ],
)
def test_parameter_has_the_type_and_the_default_that_the_code_gives_it(node, code, kind, default):
    (parameter,) = node(code).declared().parameters
    assert (parameter.name, parameter.type.kind if parameter.type else None, parameter.value) == ("x", kind, default)


def test_names_of_types_are_followed_to_what_can_be_reached(node):
    before = """
        class Diagnostics { diagnostic_updater::Updater updater_; };
        typedef Diagnostics diagnostics_type;
        using diagnostics_pointer = std::shared_ptr<diagnostics_type>;
        """
    assert found(node("diagnostics_pointer made;", before)) == {
        ("publisher", "/diagnostics", "diagnostic_msgs/DiagnosticArray")
    }


def test_class_with_a_template_is_followed_through_the_name_that_it_has_been_given(node):
    before = """
        template<typename T> class Filter {
         public:
          Filter(ros::NodeHandle nh, ros::NodeHandle pnh, int size = 15);
          void on(const nav_msgs::Odometry::ConstPtr& message);
          ros::NodeHandle nh_, pnh_;
        };
        template<typename T>
        Filter<T>::Filter(ros::NodeHandle nh, ros::NodeHandle pnh, int size) : nh_(nh), pnh_(pnh) {
          nh_.advertise<nav_msgs::Odometry>("filtered", 1);
          pnh_.subscribe("raw", 1, &Filter<T>::on, this);
        }
        typedef Filter<Kalman> KalmanFilter;
        """
    assert found(node("KalmanFilter filter(nh, pnh);", before)) == {
        ("publisher", "filtered", "nav_msgs/Odometry"),
        ("subscriber", "~raw", "nav_msgs/Odometry"),
    }


def test_handles_reach_members_of_members_and_image_transport(node):
    before = """
        struct Detector { Detector(ros::NodeHandle pnh) { pnh.getParam("family", family); } std::string family; };
        class Camera {
         public:
          Camera(ros::NodeHandle nh, ros::NodeHandle& pnh);
          Detector detector_;
          image_transport::ImageTransport inner_;
          image_transport::ImageTransport* transport_;
        };
        Camera::Camera(ros::NodeHandle nh, ros::NodeHandle& pnh) : detector_(pnh), inner_(nh) {
          transport_ = &inner_;
          transport_->advertiseCamera("front/image", 1);
        }
        """
    made = node("Camera camera(nh, pnh);", before)
    assert {name for _, name, _ in found(made)} == {"front/image", "front/camera_info"}
    assert [parameter.name for parameter in made.declared().parameters] == ["family"]


@pytest.mark.parametrize(
    ("code", "expected"),
    [
        (
            'interactive_markers::InteractiveMarkerServer server("marks", "", false);',
            {
                ("publisher", "marks/update", "visualization_msgs/InteractiveMarkerUpdate"),
                ("publisher", "marks/update_full", "visualization_msgs/InteractiveMarkerInit"),
                ("subscriber", "marks/feedback", "visualization_msgs/InteractiveMarkerFeedback"),
            },
        ),
        (
            'auto info = boost::make_shared<camera_info_manager::CameraInfoManager>(ros::NodeHandle("cam"), "front");',
            {("service server", "cam/set_camera_info", "sensor_msgs/SetCameraInfo")},
        ),
        (
            'realtime_tools::RealtimePublisher<nav_msgs::Odometry> odom(pnh, "odom", 100);',
            {("publisher", "~odom", "nav_msgs/Odometry")},
        ),
    ],
)
def test_helpers_that_many_packages_use_make_their_interfaces(node, code, expected):
    assert found(node(code)) == expected


def test_controller_manager_makes_its_services_below_the_handle_that_it_is_given(node):
    names = {name for _, name, _ in found(node("controller_manager::ControllerManager manager(&robot, nh);"))}
    assert "controller_manager/list_controllers" in names and len(names) == 6


def test_handle_may_be_the_default_of_a_parameter(node):
    before = """
        struct Chain {
          Chain(const ros::NodeHandle& nh = {}, const ros::NodeHandle& pnh = {"~"}) : nh_(nh), pnh_(pnh) {
            nh_.advertise<std_msgs::String>("out", 1);
            pnh_.advertise<std_msgs::String>("own", 1);
          }
          ros::NodeHandle nh_, pnh_;
        };
        """
    assert {name for _, name, _ in found(node("Chain chain;", before))} == {"out", "~own"}


def defaults(node: NodeSource) -> list[tuple[str, object]]:
    return [(parameter.name, parameter.default) for parameter in node.parameters]


@pytest.mark.parametrize(
    ("code", "expected"),
    [
        ('double a; pnh.param("p", a, LIMIT);', 2.5),
        ('double a; pnh.param("p", a, kRate / 2);', 5.0),
        ('double a[2]; a[0] = 0.5 * 0.5; pnh.param("p", a[0], a[0]);', 0.25),
        ('double a = 1.0; a = 2.0; double b; pnh.param("p", b, a);', 2.0),
        ('double a = unknown(); double b; pnh.param("p", b, a);', None),
        ('double a; pnh.param("p", a, std::pow(2, 3));', 8.0),
        ('double a; pnh.param("p", a, static_cast<double>(3));', 3),
        ('double a; pnh.param("p", a, std::numeric_limits<double>::max());', sys.float_info.max),
        ('bool a; pnh.param("p", a, !true);', False),
        ('std::string a; pnh.param("p", a, std::string());', ""),
        ('double a = a; double b; pnh.param("p", b, a);', None),
        ('int a; pnh.param("p", a, 1 / 0);', None),
    ],
)
def test_default_that_a_constant_holds_is_known(node, code, expected):
    result = node(code, before="#define LIMIT 2.5\nconst double kRate = 10.0;")
    assert defaults(result) == [("~p", expected)]


@pytest.mark.parametrize("number", ["1" * 5000, f"0x{'f' * 5000}"])
@pytest.mark.parametrize("value", ["{}", "LIMIT"])
def test_number_that_no_type_holds_is_not_known(node, number, value):
    code = f'double a; pnh.param("p", a, {value.format(number)});'
    assert defaults(node(code, before=f"#define LIMIT {number}")) == [("~p", None)]


def test_member_of_a_member_without_end_is_not_known(node):
    result = node(f'double a; pnh.param("p", a, {"b." * 5000}c);')
    assert defaults(result) == [("~p", None)]


@pytest.mark.parametrize(
    ("before", "code"),
    [
        (f'const char* kText = "{"a" * 200_000}";', ""),
        (f"#define LIMIT {'1' * 100_000}!", 'double a; pnh.param("p", a, LIMIT);'),
        ("", f'nh.advertise<std_msgs::String>("{"{" * 200_000}", 1);'),
    ],
    ids=["letters", "digits", "braces"],
)
def test_long_runs_of_one_character_cost_little(node, before, code):
    start = time.process_time()
    node(code, before=before).declared()
    assert time.process_time() - start < 5


def test_default_that_another_parameter_fills_is_its_default(node):
    code = 'double a, b; pnh.param("slow", a, 0.5); pnh.param("fast", b, a);'
    assert defaults(node(code)) == [("~slow", 0.5), ("~fast", 0.5)]


def test_parameter_that_fills_a_member_of_an_object_has_its_type(node):
    result = node('Settings s; pnh.getParam("count", s.count);', before="struct Settings { int count; };")
    assert [(p.name, p.kind) for p in result.parameters] == [("~count", "Integer")]


def test_text_that_is_appended_is_part_of_the_name(node):
    code = """
        std::string topic("map");
        if (second) topic += "_2";
        std::string other(topic);
        other.append("_metadata");
        nh.advertise<std_msgs::String>(topic, 1);
        nh.advertise<std_msgs::String>(other, 1);
        """
    assert {name for _, name, _ in found(node(code))} == {"map", "map_2", "map_metadata", "map_2_metadata"}


def test_types_that_two_classes_name_alike_are_kept_apart(tmp_path):
    (tmp_path / "main.cpp").write_text(
        """
        #include <ros/ros.h>
        class Left { typedef demo::LeftConfig Config; dynamic_reconfigure::Server<Config> server_; };
        class Right { typedef demo::RightConfig Config; dynamic_reconfigure::Server<Config> server_; };
        int main(int argc, char** argv) { ros::init(argc, argv, "a"); Left left; Right right; }
        """
    )
    known = {f"{side}Config": (FoundParameter(side, 1, Position(), "Integer"),) for side in ("Left", "Right")}
    result = read_cpp_node([tmp_path / "main.cpp"], tmp_path, None, Entry("", known))
    assert defaults(result) == [("~Left", 1), ("~Right", 1)]


@pytest.mark.parametrize(
    ("before", "code", "expected"),
    [
        (
            "namespace sm = std_msgs;",
            'nh.advertise<sm::String>("x", 1);',
            {("publisher", "x", "std_msgs/String")},
        ),
        (
            "using namespace tf2_ros;",
            "TransformBroadcaster broadcaster;",
            {("publisher", "/tf", "tf2_msgs/TFMessage")},
        ),
        ("", 'message_filters::Subscriber<std_msgs::String> a(nh, "", 1);', set()),
        (
            "",
            'auto p = image_transport::ImageTransport(pnh).advertiseCamera("image", 1);',
            {("publisher", "~image", "sensor_msgs/Image"), ("publisher", "~camera_info", "sensor_msgs/CameraInfo")},
        ),
        ("", "nodelet::Loader loader(false);", set()),
        (
            "",
            "nodelet::Loader loader;",
            {
                ("service server", "~list", "nodelet/NodeletList"),
                ("service server", "~load_nodelet", "nodelet/NodeletLoad"),
                ("service server", "~unload_nodelet", "nodelet/NodeletUnload"),
            },
        ),
    ],
)
def test_names_and_helpers_of_ros_are_understood(node, before, code, expected):
    assert found(node(code, before=before)) == expected


def test_filter_chain_reads_its_parameter(node):
    code = 'filters::FilterChain<std_msgs::String> chain("std_msgs::String"); chain.configure("chain", pnh);'
    assert defaults(node(code)) == [("~chain", None), ("~chain/filter_chain", None)]


def test_nodelets_that_a_program_loads_are_told_with_name_and_remappings(node):
    code = """
        nodelet::Loader loader(false);
        nodelet::M_string names;
        names["old"] = "gone";
        names.clear();
        names["input"] = "image";
        loader.load(ros::this_node::getName() + "_crop", "demo/crop", names, nodelet::V_string());
        loader.load("second", "demo/crop", names, nodelet::V_string());
        """
    first, second = node(code).nodelets
    assert (first.name, first.loaded_as, first.remappings) == (
        "{ros::this_node::getName()}_crop",
        "demo/crop",
        {"input": "image"},
    )
    assert second.name == "second"


def test_constructor_that_another_one_calls_is_run(tmp_path):
    (tmp_path / "main.cpp").write_text(
        """
        class A {
         public:
          A(int a, int b, int c) : A(a, b) {}
          A(int a, int b) { ros::NodeHandle nh; nh.advertise<std_msgs::String>("x", 1); }
        };
        int main(int argc, char** argv) { ros::init(argc, argv, "a"); A a(1, 2, 3); }
        """
    )
    assert found(read_cpp_node([tmp_path / "main.cpp"], tmp_path)) == {("publisher", "x", "std_msgs/String")}


def test_call_that_passes_no_text_for_a_text_is_none_of_the_function(node):
    before = """
        void start(std::string name, int count) { ros::NodeHandle a("~/" + name); a.param("p", count, 1); }
        """
    code = 'start("one", 1); other->start(NULL, 2); other->start(new Thing(), 2);'
    assert defaults(node(code, before=before)) == [("~one/p", 1)]


def test_names_of_one_line_that_are_not_known_are_one_parameter(node):
    before = 'void start(std::string name) { ros::NodeHandle a("~/" + name); int b; a.param("p", b, 1); }'
    declared = node("start(first()); start(second());", before=before).declared()
    assert [parameter.name for parameter in declared.parameters] == ["{first()}/p@main.cpp:2"]
