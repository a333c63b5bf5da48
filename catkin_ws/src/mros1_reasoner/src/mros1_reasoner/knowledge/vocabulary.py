"""IRIs of the vocabulary, as owl/tomasys.owl and owl/mros.owl declare them."""

from __future__ import annotations

TOMASYS = "http://metacontrol.org/tomasys#"
MROS = "http://ros/mros#"
RUNTIME = "http://metacontrol.org/runtime#"  # individuals that exist at run time only

RDF = "http://www.w3.org/1999/02/22-rdf-syntax-ns#"
RDFS = "http://www.w3.org/2000/01/rdf-schema#"
OWL = "http://www.w3.org/2002/07/owl#"
RDF_TYPE = "http://www.w3.org/1999/02/22-rdf-syntax-ns#type"
RDF_FIRST = "http://www.w3.org/1999/02/22-rdf-syntax-ns#first"
RDF_REST = "http://www.w3.org/1999/02/22-rdf-syntax-ns#rest"
RDFS_LABEL = "http://www.w3.org/2000/01/rdf-schema#label"
RDFS_COMMENT = "http://www.w3.org/2000/01/rdf-schema#comment"
RDFS_DOMAIN = "http://www.w3.org/2000/01/rdf-schema#domain"
RDFS_RANGE = "http://www.w3.org/2000/01/rdf-schema#range"
RDFS_SUB_PROPERTY_OF = "http://www.w3.org/2000/01/rdf-schema#subPropertyOf"
OWL_ONTOLOGY = "http://www.w3.org/2002/07/owl#Ontology"
OWL_IMPORTS = "http://www.w3.org/2002/07/owl#imports"
OWL_CLASS = "http://www.w3.org/2002/07/owl#Class"
OWL_OBJECT_PROPERTY = "http://www.w3.org/2002/07/owl#ObjectProperty"
OWL_DATATYPE_PROPERTY = "http://www.w3.org/2002/07/owl#DatatypeProperty"
OWL_FUNCTIONAL_PROPERTY = "http://www.w3.org/2002/07/owl#FunctionalProperty"
OWL_EQUIVALENT_PROPERTY = "http://www.w3.org/2002/07/owl#equivalentProperty"
OWL_INVERSE_OF = "http://www.w3.org/2002/07/owl#inverseOf"
OWL_NAMED_INDIVIDUAL = "http://www.w3.org/2002/07/owl#NamedIndividual"
SWRL = "http://www.w3.org/2003/11/swrl#"
SWRLB = "http://www.w3.org/2003/11/swrlb#"
XSD = "http://www.w3.org/2001/XMLSchema#"
OWLREADY = "http://www.lesfleursdunormal.fr/static/_downloads/owlready_ontology.owl#"

FUNCTION = TOMASYS + "Function"
FUNCTION_DESIGN = TOMASYS + "FunctionDesign"
OBJECTIVE = TOMASYS + "Objective"
FUNCTION_GROUNDING = TOMASYS + "FunctionGrounding"
QA_VALUE = TOMASYS + "QAvalue"
QA_TYPE = TOMASYS + "QualityAttributeType"
ENVIRONMENT_ATTRIBUTE = TOMASYS + "EnvironmentAttribute"
DECISION = TOMASYS + "Decision"
COMPONENT = TOMASYS + "Component"
COMPONENT_STATE = TOMASYS + "ComponentState"
COMPONENT_SPECIFICATION = TOMASYS + "ComponentSpecification"

SOLVES_F = TOMASYS + "solvesF"
TYPE_F = TOMASYS + "typeF"
SOLVES_O = TOMASYS + "solvesO"
TYPE_FD = TOMASYS + "typeFD"
REQUIRES_F = TOMASYS + "requiresF"
HAS_NFR = TOMASYS + "hasNFR"
HAS_QA_ESTIMATION = TOMASYS + "hasQAestimation"
HAS_QA_VALUE = TOMASYS + "hasQAvalue"
IS_QA_TYPE = TOMASYS + "isQAtype"
HAS_VALUE = TOMASYS + "hasValue"
QA_SIGN = TOMASYS + "qa_sign"
QA_COMPARISON_OPERATOR = TOMASYS + "qa_comparison_operator"
NFR_COMPARISON_OPERATOR = TOMASYS + "nfr_comparison_operator"
QA_REACHING_VIOLATES = TOMASYS + "qa_reaching_violates"
QA_CORRECTION_GROUP = TOMASYS + "qa_correction_group"
QA_TYPICAL = TOMASYS + "qa_typical"
QA_MIN = TOMASYS + "qa_min"
QA_MAX = TOMASYS + "qa_max"
O_ALWAYS_IMPROVE = TOMASYS + "o_always_improve"
O_UPDATABLE = TOMASYS + "o_updatable"
REQUIRES_O = TOMASYS + "requiresO"
FD_ERROR_LOG = TOMASYS + "fd_error_log"
REQUIRED_BY = MROS + "requiredBy"
DEPLOYED_BY = MROS + "deployedBy"

ENV_VALUE = TOMASYS + "env_value"
REQUIRES_ENVIRONMENT = TOMASYS + "requiresEnvironment"
CONSTRAINS = TOMASYS + "constrains"
ENV_LEAST = TOMASYS + "env_least"
ENV_MOST = TOMASYS + "env_most"
DECISION_OBJECTIVE = TOMASYS + "decision_objective"
DECISION_FROM = TOMASYS + "decision_from"
DECISION_TO = TOMASYS + "decision_to"
DECISION_STATE = TOMASYS + "decision_state"
DECISION_STAMP = TOMASYS + "decision_stamp"
DECISION_CAUSE = TOMASYS + "decision_cause"

C_STATUS = TOMASYS + "c_status"
O_STATUS = TOMASYS + "o_status"
FG_STATUS = TOMASYS + "fg_status"
FD_REALISABILITY = TOMASYS + "fd_realisability"
B_STATUS = TOMASYS + "b_status"
CC_AVAILABILITY = TOMASYS + "cc_availability"
CSPEC_AVAILABILITY = TOMASYS + "cspec_availability"

O_CAUSE = TOMASYS + "o_cause"
O_VIOLATED_NFR = TOMASYS + "o_violated_nfr"
FG_CAUSE = TOMASYS + "fg_cause"
FD_UNREALISABLE_BY = TOMASYS + "fd_unrealisable_by"
F_FIRST_DESIGN = TOMASYS + "f_first_design"
F_LAST_DESIGN = TOMASYS + "f_last_design"
FD_NEXT = TOMASYS + "fd_next"
FD_NONE_SO_FAR = TOMASYS + "fd_none_so_far"
F_FULFILLABLE = TOMASYS + "f_fulfillable"

HISTORY = (DECISION_OBJECTIVE, DECISION_FROM, DECISION_TO, DECISION_STATE, DECISION_STAMP, DECISION_CAUSE)
# What facts say, and what an analysis asks for.
FACTS = (
    *(TYPE_F, HAS_NFR, SOLVES_O, TYPE_FD, REQUIRES_O, HAS_QA_VALUE, IS_QA_TYPE, HAS_VALUE),
    *(O_STATUS, O_CAUSE, FG_CAUSE, C_STATUS, FD_ERROR_LOG),
    *(ENV_VALUE, *HISTORY),
)
CONCLUSIONS = (O_CAUSE, O_VIOLATED_NFR, FG_CAUSE, FD_UNREALISABLE_BY, FD_ERROR_LOG)

UNGROUNDED = "UNGROUNDED"
IN_PROGRESS = "IN_PROGRESS"
IN_ERROR_NFR = "IN_ERROR_NFR"
IN_ERROR_COMPONENT = "IN_ERROR_COMPONENT"
UPDATABLE = "UPDATABLE"
UNREACHABLE = "UNREACHABLE"

# The ontology's values of c_status. "Component status" on /diagnostics has the same; a test compares them. They are not
# taken from metacontrol_msgs, whose import would double the 0.17 s of CPU time that importing the OWL generator takes.
WORKS = "TRUE"
FAILED = "FALSE"
RECOVERED = "RECOVERED"
COMPONENT_STATUSES = (WORKS, FAILED, RECOVERED)
